import numpy as np
import pytest

from mskgrasp.benchmark.summary import (
    ANGLES,
    CAMERA_POSITION,
    CAMERA_TURN,
    DISTANCES,
    budgets,
    placing_error,
    refusals,
    stages,
    summarise,
)
from tests.benchmark.made_trials import failed, made


def test_shares_are_of_all_attempts_within_each_pair_of_tolerances():
    trials = [made(0), made(1, placed=[0.003, 0.0, np.radians(1.5)]), failed(2), made(3, wrong_pose=True)]
    (row,) = summarise(trials, 0)
    counts = [[one.n for one in shares] for shares in row.within["predicted"]]
    # 0.3 mm counts from 0.5 mm on, 3 mm at 5 mm and from 2 degrees on.
    assert counts == [[0, 0, 0], [1, 1, 1], [1, 1, 1], [1, 1, 1], [1, 2, 2]]
    assert {one.of for shares in row.within["predicted"] for one in shares} == {4}
    assert row.lifted.n == 3 and row.reasons == {"slipped": 1} and row.wrong_pose == 1
    assert (len(DISTANCES), len(ANGLES)) == (5, 3)
    # The expected displacement of 4 mm and 0.05 rad is off without a correction; the truth leaves 0.1 mm.
    assert [one[2].n for one in row.within["none"]] == [0, 0, 0, 0, 1]
    assert row.within["truth"][0][0].n == 1


def test_planners_are_kept_apart_in_their_order():
    rows = summarise([made(0, "ours"), made(0, "centroid"), failed(1, "ours")], 0)
    assert [(row.planner, row.lifted.of) for row in rows] == [("ours", 2), ("centroid", 1)]


def test_the_camera_at_the_hand_has_the_stated_errors_and_the_same_for_all_planners():
    here = dict(placed=[0.0, 0.0, 0.0], held=[0.0] * 4, expected=[0.0] * 4)
    errors = np.array([placing_error(made(number, **here), "camera", 0) for number in range(400)])
    assert np.sqrt((errors[:, 0] ** 2).mean() / 2) == pytest.approx(CAMERA_POSITION, rel=0.1)
    assert np.sqrt((errors[:, 1] ** 2).mean()) == pytest.approx(CAMERA_TURN, rel=0.1)
    ours, other = (placing_error(made(0, planner, **here), "camera", 0) for planner in ("ours", "centroid"))
    assert ours == other != placing_error(made(0, **here), "camera", 1)
    assert placing_error(failed(0), "camera", 0) is None


def test_attempts_for_which_a_planner_plans_nothing_are_not_tried():
    good = [made(number, "program", quality=0.9) for number in range(2)]
    nothing = dict(grasp=None, quality=None, reason="no grasp found")
    found = refusals([*good, *(failed(number, planner="program", **nothing) for number in range(2, 10))], 0)
    assert {(one.refused, one.placed.n, one.placed.of) for one in found} == {(0.8, 2, 2)}


def test_precision_rises_as_attempts_of_low_quality_are_refused():
    good = [made(number, quality=0.95) for number in range(5)]
    poor = [failed(number, quality=0.1 + 0.01 * number) for number in range(5, 9)]
    unseen = [failed(9, quality=None, reason="no part found")]
    found = refusals([*good, *poor, *unseen, made(0, "centroid", quality=None)], 0)
    assert {one.planner for one in found} == {"ours"}
    assert [(round(one.refused, 2), one.placed.n, one.placed.of) for one in found][:2] == [
        (0.0, 5, 10),
        (0.1, 5, 9),
    ]
    last = found[-1]
    assert (last.refused, last.bound, last.placed.n, last.placed.of) == (0.5, 0.95, 5, 5)
    assert all(a.placed.value <= b.placed.value for a, b in zip(found, found[1:], strict=False))


def test_attempts_that_the_planner_refused_itself_are_not_among_those_tried():
    good = [made(number, quality=0.9) for number in range(5)]
    refused = [failed(number, quality=0.1 * number - 0.4, reason="refused") for number in range(5, 9)]
    unseen = [failed(9, quality=None, reason="no part found")]
    found = refusals([*good, *refused, *unseen], 0)
    assert [(round(one.refused, 2), one.bound, one.placed.n, one.placed.of) for one in found] == [
        (0.4, 0.0, 5, 6),
        (0.5, 0.9, 5, 5),
    ]
    assert refusals(refused, 0) == []


def test_the_stages_add_up_to_the_total():
    found = stages(made(0))
    assert found["seeing"] == pytest.approx([0.0004, 0.0003, 0.0])
    assert found["seizing"] == pytest.approx([0.0002, 0.0, 0.002])
    assert found["carrying"] == pytest.approx([0.00005, 0.0, 0.0])
    assert found["releasing"] == pytest.approx([0.00005, 0.0, 0.0])
    # The seen centre is what is placed: its error is not in the total.
    assert found["total"] == pytest.approx(found["seizing"] + found["carrying"] + found["releasing"])
    assert found["total"] == pytest.approx([0.0003, 0.0, 0.002])
    nothing = stages(failed(0))
    assert nothing["total"] is None and nothing["releasing"] is None and nothing["seizing"] is None


def test_the_budget_is_of_placed_attempts_first_of_all_parts_then_of_each():
    trials = [made(0), made(0, part="bolt", placed=[0.0013, 0.0, 0.0]), failed(1, part="bolt")]
    total, nut, bolt = budgets(trials)
    assert [(one.part, one.n) for one in (total, nut, bolt)] == [("", 2), ("nut", 1), ("bolt", 1)]
    assert total.distance["total"] == pytest.approx(0.0008) and bolt.distance["total"] == pytest.approx(
        0.0013
    )
    assert bolt.distance["releasing"] == pytest.approx(0.00105)
    assert nut.distance["seeing"] == pytest.approx(0.0005) and nut.turn["total"] == pytest.approx(0.002)
    (none, _) = budgets([failed(0)])
    assert none.n == 0 and set(none.distance.values()) == {None}
