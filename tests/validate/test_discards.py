import pytest

from mskgrasp.validate.discards import summarise_discards
from tests.validate.made_up import outcomes


def test_what_cannot_be_is_counted_by_reason():
    sick = outcomes()
    sick.penetration[3], sick.fastest[5], sick.displacement[8, 0] = 0.002, 4.0, 0.06
    sick.settled[11] = False
    told = summarise_discards(sick)
    assert told.dropped == {
        "unsettled": 1,
        "penetrated": 1,
        "too_fast": 1,
        "moved_too_far": 1,
        "not_finite": 0,
    }
    assert told.penetration == 0 and told.fastest == pytest.approx(0.3) and told.displaced < 0.05
