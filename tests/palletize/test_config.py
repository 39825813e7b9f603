"""Settings of palletizing."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.palletize.config import PalletizeConfig


def test_a_malformed_target_is_refused(tmp_path):
    with pytest.raises(ValueError, match="target must be x,y,theta"):
        PalletizeConfig(out=tmp_path, target="0.5;0.1;90")


def test_a_single_target_is_the_only_slot_and_a_file_takes_its_place(tmp_path):
    (slot,) = PalletizeConfig(target="0.55,-0.1,30").all_slots()
    assert (slot.x, slot.y, slot.size) == (0.55, -0.1, None) and slot.theta == pytest.approx(np.pi / 6)
    path = tmp_path / "slots.yaml"
    path.write_text("slots: [{x: 0.5, y: 0.2}, {x: 0.4, y: 0.2}]")
    assert [slot.x for slot in PalletizeConfig(slots=path).all_slots()] == [0.5, 0.4]


def test_tape_measures_only_where_its_sizes_are_given():
    assert PalletizeConfig().squares() is None
    tape = PalletizeConfig(tape=(0.012, 0.008)).squares()
    assert tape is not None and tape.sides == (0.012, 0.008)
    with pytest.raises(ValueError, match="at least 1.25 times small"):
        PalletizeConfig(tape=(0.008, 0.012))


@pytest.mark.parametrize(
    "values", [dict(workers=-1), dict(trials=0), dict(corrections=("best",)), dict(seed=-1)]
)
def test_what_cannot_be_run_is_refused(values):
    with pytest.raises(ValueError):
        PalletizeConfig.model_validate(values)
