"""Steps of a trial in the simulated cell, on a box whose motion in the hand is known."""

from __future__ import annotations

import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest

from hal import Arm, Cell, Load
from hal.errors import (
    ArmInView,
    CaptureFailed,
    LoadTooHeavy,
    MotionAborted,
    NeedsRecovery,
    NotCalibrated,
    Stopped,
)
from hal.operator import Operator
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.core.shipped import SIMULATED_CELL, config_file
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.trials.engine import ExecutedGrasp, PlannedGrasp, TrialEngine, connected_engine
from tests.hal.real_cell import measured_cell
from tests.hal.replay.toy import toy_cell
from tests.planning.hand_made import FRAME, planner
from tests.trials.box_grasps import SIZE, BesideTheMiddle, BoxCell


def test_a_box_beside_the_middle_of_the_hand_ends_in_its_middle(box_cell: BoxCell):
    planned = box_cell.present(along=0.008, across=0.006)
    assert planned.plan is not None and not planned.reason
    done = box_cell.engine.grasp(planned.plan)
    assert done.reason == "" and not done.aborted and done.result is not None
    assert done.result.width == pytest.approx(0.02, abs=5e-4)
    # The hand is 6 mm beside it: the fingers push it by as much, and leave it where it is along them.
    assert done.displacement is not None and done.tilt is not None
    np.testing.assert_allclose(done.displacement[:3], [0, 0.006, 0], atol=8e-4)
    assert abs(done.displacement[3]) < np.radians(0.5) and done.tilt < np.radians(1)


def test_a_seed_presents_the_same_scene_again(box_cell: BoxCell):
    first, again = box_cell.present(), box_cell.present()
    np.testing.assert_array_equal(first.frame.depth, again.frame.depth)
    assert first.plan is not None and again.plan is not None
    np.testing.assert_array_equal(first.plan.candidates.as_vector(), again.plan.candidates.as_vector())


def test_depth_is_captured_in_the_resolution_of_a_file(box_cell: BoxCell):
    box_cell.engine.home()
    steps = box_cell.engine.capture().depth.astype(np.float64) / 1e-4
    assert np.abs(steps - np.rint(steps)).max() < 0.01
    # Beyond 6.5535 m a file holds nothing. The toy camera's k-th frame is k metres away.
    cell = toy_cell()
    cell.arm.connect()
    engine = TrialEngine(cell, Operator(cell, yes=True))
    seen = [engine.capture().depth for _ in range(3)]
    with pytest.raises(CaptureFailed):
        engine.capture()
    seen += [engine.capture().depth for _ in range(3)]
    assert [float(np.nanmax(depth)) for depth in seen[:5]] == pytest.approx([1, 2, 3, 5, 6], abs=1e-6)
    assert np.isnan(seen[5]).all() and np.isnan(seen[0][0, 0])


def test_a_grasp_over_the_part_misses_and_one_on_its_top_collides(box_cell: BoxCell):
    over = box_cell.present(up=0.06)
    assert over.plan is not None
    missed = box_cell.engine.grasp(over.plan)
    assert missed.reason == "missed" and missed.displacement is None and missed.before is not None
    # 45 mm aside, a finger of 26 mm comes down on the box.
    beside = box_cell.present(across=0.045)
    assert beside.plan is not None
    collided = box_cell.engine.grasp(beside.plan)
    assert collided.reason == "collided" and "force" in collided.aborted
    with pytest.raises(NeedsRecovery):
        box_cell.engine.cell.arm.move_gripper(0.04)
    box_cell.engine.recover(MotionAborted(collided.aborted))
    box_cell.engine.home()
    np.testing.assert_allclose(
        box_cell.engine.cell.arm.state().joints, box_cell.engine.cell.workspace.home, atol=0.01
    )


@pytest.mark.slow
def test_a_held_part_is_put_down_on_the_way_home_not_dropped(box_cell: BoxCell):
    planned = box_cell.present()
    assert planned.plan is not None and box_cell.engine.grasp(planned.plan).reason == ""
    lifted = box_cell.engine.part_pose()
    assert lifted is not None and lifted.position[2] > 0.09
    box_cell.engine.home()
    lying = box_cell.engine.part_pose()
    assert lying is not None and lying.position[2] == pytest.approx(SIZE[2] / 2, abs=1e-3)
    np.testing.assert_allclose(lying.position[:2], lifted.position[:2], atol=2e-3)
    assert box_cell.engine.cell.arm.in_hand() is None


def test_no_grasp_is_planned_while_the_arm_may_be_in_view(box_cell: BoxCell):
    engine = box_cell.engine
    engine.home()
    engine.cell.arm.move_to_joints(engine.cell.workspace.home + np.array([0, 0.1, 0, 0, 0, 0, 0]))
    with pytest.raises(ArmInView, match=r"joint 2 is 0.10 rad from home: .*move it home first"):
        engine.capture()
    engine.home()
    engine.capture()


def test_a_grasp_out_of_reach_is_refused_before_anything_moves(box_cell: BoxCell):
    planned = box_cell.present()
    assert planned.plan is not None
    far = dataclasses.replace(planned.plan, grasp=Grasp.from_vector(np.array([1.0, 0.0, 0.02, 0.0])))
    joints = box_cell.engine.cell.arm.state().joints
    done = box_cell.engine.grasp(far)
    assert (done.reason, done.result, done.aborted) == ("out of workspace", None, "")
    np.testing.assert_array_equal(box_cell.engine.cell.arm.state().joints, joints)


def test_a_part_none_of_whose_grasps_is_worth_trying_is_a_result(box_cell: BoxCell):
    certain = planner(PlannerConfig(n_candidates=20, min_quality=1.0))
    planned = box_cell.engine.present(box_cell.part, box_cell.seed, certain)
    assert planned.plan is None and planned.reason == "refused"
    assert planned.best_quality is not None and planned.best_quality < 1


def test_an_operator_decides_whether_a_part_that_is_refused_is_placed_again(
    box_cell: BoxCell, tmp_path, monkeypatch
):
    """Placed again once, then the run goes on without it."""
    cell = box_cell.engine.cell
    monkeypatch.setattr(type(cell.arm), "simulated", False)
    asked = io.StringIO()
    operator = Operator(cell, answers=io.StringIO("y\nn\n"), prompts=asked)
    engine = TrialEngine(cell, operator, picture=tmp_path / "next.png")
    certain = planner(PlannerConfig(n_candidates=20, min_quality=1.0))
    planned = engine.present(box_cell.part, box_cell.seed, certain)
    assert planned.reason == "refused" and planned.plan is None
    assert asked.getvalue().count("no grasp was planned: no grasp found (best quality 0.") == 2
    assert "May the arm move" not in asked.getvalue()


def test_an_operator_who_is_asked_sees_the_plan_and_may_have_the_part_placed_again(
    box_cell: BoxCell, tmp_path, monkeypatch
):
    cell = box_cell.engine.cell
    monkeypatch.setattr(type(cell.arm), "simulated", False)
    asked = io.StringIO()
    operator = Operator(cell, answers=io.StringIO("n\ny\n"), prompts=asked)
    engine = TrialEngine(cell, operator, picture=tmp_path / "next.png")
    planned = engine.present(
        box_cell.part, box_cell.seed, BesideTheMiddle(engine, 0.0, 0.0, 0.0), then="then to the pallet"
    )
    assert planned.plan is not None and (tmp_path / "next.png").stat().st_size > 10_000
    assert asked.getvalue().count(f"{planned.plan.summary}; then to the pallet") == 2


def test_a_camera_measured_by_hand_ends_a_trial_before_anything_moves(box_cell: BoxCell, monkeypatch):
    monkeypatch.setattr(type(box_cell.engine.cell.camera), "by_hand", True)
    monkeypatch.setattr(Arm, "open_gripper", None)  # would fail if it were tried
    with pytest.raises(NotCalibrated, match="measured by hand"):
        box_cell.engine.present(box_cell.part, box_cell.seed, BesideTheMiddle(box_cell.engine, 0.0, 0.0, 0.0))


def test_a_part_over_what_the_arm_carries_ends_a_trial_before_anything_moves(box_cell: BoxCell, monkeypatch):
    arm = box_cell.engine.cell.arm
    monkeypatch.setattr(arm, "limits", dataclasses.replace(arm.limits, max_load=0.099))
    monkeypatch.setattr(Arm, "open_gripper", None)  # would fail if it were tried
    with pytest.raises(LoadTooHeavy, match=r"weighs 0.100 kg, this arm carries 0.099 kg: leave it out"):
        box_cell.present()


def test_the_arm_is_told_the_part_that_it_lifts_and_forgets_it_as_the_hand_opens(
    box_cell: BoxCell, monkeypatch
):
    told: list[Load | None] = []
    monkeypatch.setattr(type(box_cell.engine.cell.arm), "_set_load", lambda self, load: told.append(load))
    planned = box_cell.present(along=0.008, across=0.006, up=0.004)
    assert planned.plan is not None and planned.part is not None
    assert box_cell.engine.grasp(planned.plan, planned.part).reason == ""
    (load,) = told
    assert load is not None and load.mass == pytest.approx(0.1)
    # In the tcp frame, whose z points down: the box's centre as seen before the grasp.
    assert np.abs(load.centre_tcp[:2]) == pytest.approx([0.008, 0.006], abs=1.5e-3)
    assert load.centre_tcp[2] == pytest.approx(0.004, abs=1.5e-3)
    assert np.diag(load.inertia) == pytest.approx(np.full(3, planned.part.principal_inertia.mean()))
    box_cell.engine.home()
    assert told == [load, None]


def test_a_person_who_stops_the_arm_is_not_overruled(box_cell: BoxCell):
    with pytest.raises(Stopped, match="by hand"):
        box_cell.engine.recover(Stopped("by hand"))


def test_the_displacement_of_the_seen_centre_follows_the_rigid_motion():
    """By hand: the part turns by a quarter turn about its origin, 10 mm from which its seen centre lies."""
    plan = planner(PlannerConfig(n_candidates=20)).plan(FRAME, np.random.default_rng(0))
    x_grasp = plan.grasp.T_base_grasp.as_matrix()[:3, 0]
    before = Pose(position=plan.view.centre_base - 0.01 * x_grasp, quat_wxyz=np.array([1.0, 0, 0, 0]))
    done = ExecutedGrasp(reason="", before=before, displacement=np.array([0.001, 0.0, 0.002, np.pi / 2]))
    # The centre moves from (10, 0) mm to (0, 10) mm as seen from the origin.
    expected = [0.001 - 0.01, 0.01, 0.002, np.pi / 2]
    np.testing.assert_allclose(done.displacement_of_centre(plan), expected, atol=1e-12)
    assert dataclasses.replace(done, before=None).displacement_of_centre(plan) is None


def test_a_real_cell_is_not_connected_where_nobody_can_be_asked(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO())
    monkeypatch.setattr(Cell, "connected", None)  # would fail if it were tried
    with (
        pytest.raises(UsageError, match="standard input is no terminal"),
        connected_engine(measured_cell(tmp_path), yes=False, picture=tmp_path, tape=None),
    ):
        pass


@pytest.mark.slow
def test_a_part_that_hooks_on_a_finger_is_taken_away_by_the_next_scene(tmp_path: Path):
    """The pads close within the bore of a nut that stands on its edge, and cannot leave it."""
    with connected_engine(SIMULATED_CELL, yes=True, picture=tmp_path / "next.png", tape=None) as engine:
        seed, _ = trial_seeds(0, "hex_nut_m30", 0)
        planned = engine.present("hex_nut_m30", seed, planner())
        assert planned.plan is not None
        grasp = Grasp.from_vector(np.array([0.42189, 0.07477, 0.02451, 1.32814]))
        assert engine.grasp(dataclasses.replace(planned.plan, grasp=grasp)).reason == ""
        with pytest.raises(MotionAborted, match="contact force") as raised:
            engine.home()
        engine.recover(raised.value)
        assert not engine.leave()
        again = engine.present("hex_nut_m30", seed, planner())
        np.testing.assert_array_equal(again.frame.depth, planned.frame.depth)
        np.testing.assert_allclose(engine.cell.arm.state().joints, engine.cell.workspace.home, atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["sapien", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_a_new_scene_empties_the_hand_and_is_as_after_going_home(cell: str, tmp_path: Path):
    path, (seed, _) = config_file(f"cells/{cell}.yaml"), trial_seeds(0, "washer_m36", 0)
    with connected_engine(path, yes=True, picture=tmp_path / "next.png", tape=None) as engine:

        def trial() -> tuple[PlannedGrasp, ExecutedGrasp]:
            planned, lying = engine.present("washer_m36", seed, planner()), engine.part_pose()
            assert planned.plan is not None and lying is not None
            grasp = Grasp.from_vector(np.array([*lying.position[:2] + 0.003, 0.0115, 0.4]))
            return planned, engine.grasp(dataclasses.replace(planned.plan, grasp=grasp), planned.part)

        first, second = trial(), trial()  # the hand holds a part in between
        engine.leave()
        third = trial()
        assert engine.cell.arm.in_hand() is not None
        for planned, done in (second, third):
            np.testing.assert_array_equal(planned.frame.depth, first[0].frame.depth)
            assert done.reason == "" and done.displacement is not None
            np.testing.assert_array_equal(done.displacement, first[1].displacement)
        engine.present("washer_m36", seed, planner())
        assert engine.cell.arm.in_hand() is None
        np.testing.assert_allclose(engine.cell.arm.state().joints, engine.cell.workspace.home, atol=0.01)
