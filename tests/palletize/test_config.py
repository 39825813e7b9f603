"""Settings of palletizing."""

from __future__ import annotations

from pathlib import Path

import pytest

from mskgrasp.palletize.config import PalletizeConfig


@pytest.mark.parametrize("text", ["0.5,0.1", "a,b,c", "0.5,nan,0", "0.5 0.1 0", "0.5;0.1;90"])
def test_an_invalid_target_is_refused(text):
    with pytest.raises(ValueError, match="target must be"):
        PalletizeConfig(target=text)


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


def test_slots_and_a_target_exclude_each_other():
    assert PalletizeConfig(slots=Path("grid.yaml")).slots == Path("grid.yaml")
    with pytest.raises(ValueError, match="target and slots exclude each other"):
        PalletizeConfig(slots=Path("grid.yaml"), target="0.5,0.06,0")
