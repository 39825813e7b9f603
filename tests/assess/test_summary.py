import pytest

from mskgrasp.assess.config import parse_tolerance
from mskgrasp.assess.summary import DISTANCES, summarise, verdict
from mskgrasp.assess.trials import EXACT
from mskgrasp.core.grasp import TILT_LIMIT
from tests.assess.made_trials import failed, made

TOLERANCE = parse_tolerance("1mm,2deg")


def rows(trials, tolerance=TOLERANCE):
    return summarise(trials, tolerance, TILT_LIMIT)


def test_shares_are_of_all_attempts():
    (row,) = rows([made(0), made(1), failed(2), made(3, tilt=0.2)])
    assert (row.lifted.n, row.lifted.of) == (3, 4)
    assert row.within["predicted"] == row.lifted and row.within["none"].n == 0
    assert [share.n for share in row.within_distance["predicted"]] == [0, 0, 3, 3, 3, 3]
    assert len(row.within_distance["none"]) == len(DISTANCES)
    assert row.reasons == {"slipped": 1} and row.tilted == 1
    assert row.translation_rmse == pytest.approx(0.0002) and row.rotation_rmse == pytest.approx(0.002)


def test_conditions_and_means_are_kept_apart():
    found = rows([made(0), made(0, planner="networks"), made(0, condition="friction 0.3")])
    assert [(row.condition, row.planner) for row in found] == [
        (EXACT, "certified"), (EXACT, "networks"), ("friction 0.3", "certified"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "advice"),
    [
        (dict(expected=[1e-4, 0, 0, 0], held=[1e-4, 0, 0, 0]), "place directly"),
        (dict(), "correct by the prediction"),
        (dict(placed=[0.003, 0, 0], held=[0.007, 0, 0, 0.05]), "look at the part in the hand"),
        (dict(placed=[0.003, 0, 0], held=[0.004, 0, 0, 0.05]), "use a fixture or another pose"),
    ],
)
def test_the_advice_is_the_least_effort_that_is_enough(changes, advice):
    text = verdict(rows([made(number, **changes) for number in range(20)]), EXACT, TOLERANCE)
    assert text.startswith(f"{advice}: ")


def test_one_failure_in_twenty_is_enough_and_two_are_not():
    twenty = [made(number) for number in range(20)]
    assert verdict(rows([*twenty[1:], failed(0)]), EXACT, TOLERANCE).startswith("correct")
    two = verdict(rows([*twenty[2:], failed(0), failed(1)]), EXACT, TOLERANCE)
    assert two.startswith("use a fixture") and "18 of 20" in two


def test_the_better_means_counts():
    poor = [made(number, planner="certified", placed=[0.01, 0, 0]) for number in range(10)]
    good = [made(number, planner="networks") for number in range(10)]
    assert "by the networks" in verdict(rows([*poor, *good]), EXACT, TOLERANCE)


def test_grasps_that_the_networks_planned_are_not_called_certified():
    none = [made(number, planned_by="networks") for number in range(20)]
    assert verdict(rows(none), EXACT, TOLERANCE).endswith(" by the networks (no certified grasp)")
    some = [made(number, planned_by="certified" if number < 15 else "networks") for number in range(20)]
    said = verdict(rows(some), EXACT, TOLERANCE)
    assert said.endswith(" by certified grasps in 15 of 20 attempts, else the networks")
    others = [made(number, planned_by="uncertified") for number in range(20)]
    assert verdict(rows(others), EXACT, TOLERANCE).endswith(" by uncertified ones (no certified grasp)")
    said = verdict(rows(some[:17] + others[:3]), EXACT, TOLERANCE)
    assert said.endswith(
        " by certified grasps in 15 and uncertified ones in 3 of 20 attempts, else the networks"
    )
    nothing = [made(number, planned_by=None, lifted=False, placed=None) for number in range(5)]
    said = verdict(rows([*(made(number) for number in range(15)), *nothing]), EXACT, TOLERANCE)
    assert " by certified grasps in 15 of 20 attempts, corrected by" in said
    unknown = [made(number, planned_by="networks") for number in range(18)]
    said = verdict(rows(unknown + nothing[:2]), EXACT, TOLERANCE)
    assert " by the networks in 18 of 20 attempts (no certified grasp)" in said
    assert [row.planned_by for row in rows(nothing)] == ["nothing: no grasp was planned"]
    all_of_them = [made(number) for number in range(20)]
    assert verdict(rows(all_of_them), EXACT, TOLERANCE).endswith(" by certified grasps")


def test_parts_that_nothing_lifts_are_named_so():
    assert verdict(rows([failed(0)]), EXACT, TOLERANCE) == "no grasp lifted the part"
    assert verdict([], EXACT, TOLERANCE) == "no trial was made"
