import numpy as np
import pytest

from mskgrasp.trials.placed_trial import PlacedTrial
from tests.assess.made_trials import failed, made


def test_errors_of_the_three_ways_of_placing():
    trial = made(0)
    assert trial.error("predicted") == (pytest.approx(0.0003), pytest.approx(0.002))
    # Uncorrected, the part is off by the displacement that was expected, too.
    assert trial.error("none") == (pytest.approx(0.0043), pytest.approx(0.052))
    # Seen in the hand, by the release alone: it was off by 0.2 mm in the hand.
    assert trial.error("seen") == (pytest.approx(0.0001), pytest.approx(0.0, abs=1e-12))


def test_a_part_that_was_not_placed_has_no_error():
    assert failed(0).error("predicted") is None
    assert made(0, placed=None).error("none") is None
    assert made(0, wrong_pose=True).error("predicted") is None


def test_the_error_is_that_of_the_offset():
    off = made(0, placed=[0.0003, 0.0004, 0.002]).off("predicted")
    assert off == pytest.approx([0.0003, 0.0004, 0.002])
    assert made(0, placed=[0.0003, 0.0004, 0.002]).error("predicted")[0] == pytest.approx(0.0005)
    assert failed(0).off("predicted") is None


def test_a_trial_of_an_earlier_run_has_no_stages():
    values = made(0).to_json()
    del values["seeing"], values["carried"]
    assert PlacedTrial.from_json(values).carried is None


def test_a_turn_is_wrapped():
    assert made(0, placed=[0.0, 0.0, 2 * np.pi - 0.01]).error("predicted")[1] == pytest.approx(0.01)


def test_a_trial_is_stored_as_it_is():
    assert PlacedTrial.from_json(made(3).to_json()) == made(3)
