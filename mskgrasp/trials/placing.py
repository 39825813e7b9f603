"""One trial of the whole loop on a cell: look, plan, grasp, place, and measure how far the part is off."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from hal.errors import LoadTooHeavy, MotionAborted, OutOfWorkspace
from mskgrasp.core.geometry import (
    Pose,
    quat_about_z,
    quat_conjugate,
    quat_multiply,
    twist_and_swing,
    twist_and_swing_between,
    wrap_angle,
)
from mskgrasp.core.grasp import Grasp, centre_in_grasp_frame, object_displacement
from mskgrasp.parts import Part
from mskgrasp.perception.part_pose import PartPose
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import (
    Target,
    displacement_of_point,
    drop_of,
    place,
    place_pose,
    taken_along,
)
from mskgrasp.planning.release import release_opening
from mskgrasp.trials.engine import PlannedGrasp, PlansGrasps, TrialEngine
from mskgrasp.trials.placed_trial import TOO_HEAVY, PlacedTrial
from mskgrasp.trials.trial import reason_of

TURNS = float(np.radians(45.0))
"""Greatest turn of a part from where it lies to its target, radians."""


def trials_of_scene(
    engine: TrialEngine,
    planner_of: Callable[[str], PlansGrasps],
    part: Part,
    seeds: tuple[int, int],
    trials: Sequence[PlacedTrial],
    like: Mapping[int, tuple[int, float]],
) -> Iterator[PlacedTrial]:
    """Make trials in one scene, one after the other.

    In each the part is grasped as planned, and placed in the middle of the region, corrected by the
    prediction. A plan that equals that of an earlier trial is not tried again: a scene is simulated anew from
    its seed for each, so that its outcome would be the same.

    Args:
        engine: Engine of a cell with a feeder and a tracker.
        planner_of: The planner of this name.
        part: The part.
        seeds: Of the scene and of the target's turn: `mskgrasp.core.seeds.trial_seeds`.
        trials: Name the trials; their outcomes are filled in.
        like: Resting poses that equal another one, as in `mskgrasp.planning.certified.CertifiedGrasps`.

    Raises:
        HalError: The cell was lost.
    """
    tried: list[tuple[GraspPlan, PlacedTrial]] = []
    for trial in trials:
        try:
            planned = engine.present(str(part.folder), seeds[0], planner_of(trial.planner))
        except LoadTooHeavy:
            yield replace(trial, reason=f"{TOO_HEAVY} ({part.mass:.1f} kg)")
            continue
        plan = planned.plan
        if plan is None:
            yield replace(trial, reason=planned.reason, quality=planned.best_quality)
            continue
        same = next((outcome for other, outcome in tried if _equal(plan, other)), None)
        if same is None:
            done = _carried_out(engine, planned, plan, part, seeds[1], trial, like)
        else:
            done = replace(same, planner=trial.planner)
        tried.append((plan, done))
        yield done


def _equal(plan: GraspPlan, other: GraspPlan) -> bool:
    """Whether two plans in one scene differ in nothing that is carried out or recorded."""
    pairs = zip(_what_counts(plan), _what_counts(other), strict=True)
    return all(np.array_equal(one, two, equal_nan=not isinstance(one, str)) for one, two in pairs)


def _what_counts(plan: GraspPlan) -> tuple[ArrayLike, ...]:
    pose = plan.pose
    found = (-1, np.zeros((4, 4))) if pose is None else (pose.resting, pose.T_base_obj.as_matrix())
    return (
        plan.planned_by,
        plan.grasp.as_vector(),
        plan.quality,
        plan.grasp_displacement,
        plan.swing,
        plan.view.centre_base,
        plan.view.size,
        *found,
    )


def _carried_out(
    engine: TrialEngine,
    planned: PlannedGrasp,
    plan: GraspPlan,
    part: Part,
    target_seed: int,
    trial: PlacedTrial,
    like: Mapping[int, tuple[int, float]],
) -> PlacedTrial:
    """Grasp and place the presented part as planned."""
    trial = replace(
        trial,
        planned_by=plan.planned_by,
        quality=None if np.isnan(plan.quality) else plan.quality,
        grasp=plan.grasp.as_vector().tolist(),
    )
    lay = engine.part_pose()
    assert lay is not None  # the cell has a tracker
    seen, point = lay, np.asarray(plan.view.centre_base)
    if plan.pose is None:
        trial = replace(trial, seeing=_centre_error(part, plan, lay).tolist())
    else:
        found = as_turned(part, plan.pose, lay, like)
        trial = replace(trial, resting=plan.pose.resting, wrong_pose=found is None)
        seen = found or plan.pose.T_base_obj
        point = np.asarray(seen.position)
        if found is not None:
            trial = replace(trial, seeing=_pose_error(plan.grasp, found, lay).tolist())
    done = engine.grasp(plan, planned.part)
    if done.aborted:
        engine.recover(MotionAborted(done.aborted))
    if done.reason or done.result is None or done.before is None or done.displacement is None:
        return replace(trial, reason=done.reason)
    lifted = engine.part_pose()
    assert lifted is not None
    in_hand = done.result.T_base_tcp.inverse() @ lifted
    of_origin, _ = object_displacement(plan.grasp.T_base_tcp.inverse() @ seen, in_hand)
    grasp = plan.grasp.as_vector()
    origin, of_point = (centre_in_grasp_frame(np.asarray(one), grasp) for one in (seen.position, point))
    expected = plan.displacement_of(point)[0]
    trial = replace(
        trial,
        lifted=True,
        predicted=plan.displacement_of(np.asarray(done.before.position))[0].tolist(),
        measured=done.displacement.tolist(),
        held=displacement_of_point(np.asarray(of_origin), origin, of_point).tolist(),
        expected=expected.tolist(),
        tilt=done.tilt,
    )
    opening = release_opening(planned.frame, plan, done.result.width)
    return _placed(engine, plan, lay, seen, point, in_hand, expected, opening, target_seed, trial)


def _placed(
    engine: TrialEngine,
    plan: GraspPlan,
    lay: Pose,
    seen: Pose,
    point: np.ndarray,
    in_hand: Pose,
    expected: np.ndarray,
    opening: float | None,
    target_seed: int,
    trial: PlacedTrial,
) -> PlacedTrial:
    """Place the held part, a point of it at the target, turned at random, and measure how far it is off."""
    workspace = engine.cell.workspace
    turn = np.random.default_rng(target_seed).uniform(-TURNS, TURNS)
    x, y = workspace.centre
    drop = drop_of(plan.grasp, plan.view, float(expected[3]), np.nan_to_num(plan.swing))
    released: list[Pose] = []

    def arrived() -> None:
        there = engine.part_pose()
        assert there is not None
        released.append(engine.cell.arm.state().T_base_tcp.inverse() @ there)

    for theta in (turn, 0.0):
        target = Target(x=float(x), y=float(y), theta=float(theta))
        pose = place_pose(plan.grasp, expected, point, target, workspace.lowest_grasp_z, drop=drop)
        try:
            place(
                engine.cell, pose, engine.recover, drop=drop, opening=opening,
                part_height=float(plan.view.size[2]), arrived=arrived,
            )  # fmt: skip
            break
        except OutOfWorkspace:
            if released:
                raise
        except MotionAborted as error:
            engine.recover(error)
            return replace(trial, reason="collided")
    else:
        engine.put_back(plan)
        return replace(trial, reason=reason_of(OutOfWorkspace))
    after = engine.part_pose()
    assert after is not None
    if taken_along(lay, after):
        return replace(trial, reason="not released")
    point_tcp = in_hand.apply(seen.inverse().apply(point))
    return replace(
        trial,
        carried=_moved(in_hand, released[0], point_tcp).tolist(),
        placed=_off(pose, seen, point, after, target).tolist(),
    )


def as_turned(part: Part, found: PartPose, true: Pose, like: Mapping[int, tuple[int, float]]) -> Pose | None:
    """The found pose with the orientation that differs least from the true one by symmetries of the part.

    A hexagon nut found 60 degrees off counts as right, by its symmetry. A part that only looks the same, such
    as a plate with a small hole near one end, does not.

    Args:
        part: The part.
        found: Its pose as found.
        true: Its true pose, ``T_base_obj``.
        like: As in `trials_of_scene`.

    Returns:
        ``T_base_obj``, or None where another resting pose was found.
    """
    quats = part.resting.quat_wxyz
    swings = [twist_and_swing(quat_multiply(true.quat_wxyz, quat_conjugate(quat)))[1] for quat in quats]
    turns, groups = [], []
    for number, pose in ((found.resting, found.T_base_obj), (int(np.argmin(swings)), true)):
        group, offset = like.get(number, (number, 0.0))
        turn, _ = twist_and_swing(quat_multiply(pose.quat_wxyz, quat_conjugate(quats[number])))
        turns.append(float(turn) + offset)
        groups.append(group)
    if groups[0] != groups[1]:
        return None
    order = found.symmetry if found.symmetric else 1
    off = 0.0  # of a body of revolution no turn is wrong
    if order:
        period = 2 * np.pi / order
        off = turns[0] - turns[1]
        off -= period * round(off / period)
    quat = quat_multiply(quat_about_z(np.asarray(off)), true.quat_wxyz)
    return Pose(position=np.asarray(found.T_base_obj.position), quat_wxyz=quat)


def _centre_error(part: Part, plan: GraspPlan, true: Pose) -> np.ndarray:
    """(3,) x and y of the seen centre less that of the part's true box, axes of the grasp frame, and 0."""
    vertices = np.asarray(trimesh.load_mesh(part.mesh_path, process=False).vertices, dtype=np.float64)
    box = plan.view.T_base_box.inverse().apply(true.apply(vertices))[:, :2]
    off = plan.view.T_base_box.apply(np.append((box.min(axis=0) + box.max(axis=0)) / 2, 0.0))
    return np.append(_along(plan.grasp, np.asarray(plan.view.centre_base) - off), 0.0)


def _pose_error(grasp: Grasp, found: Pose, true: Pose) -> np.ndarray:
    """(3,) x, y and turn of a found pose less those of the true one, axes of the grasp frame."""
    turn, _ = twist_and_swing_between(true, found)
    return np.append(_along(grasp, np.asarray(found.position) - np.asarray(true.position)), float(turn))


def _along(grasp: Grasp, vector_base: np.ndarray) -> np.ndarray:
    """(2,) a vector (3,) along the axes of a grasp."""
    cos, sin = np.cos(grasp.theta), np.sin(grasp.theta)
    x, y = vector_base[:2]
    return np.array([cos * x + sin * y, cos * y - sin * x])


def _moved(before: Pose, after: Pose, point_tcp: np.ndarray) -> np.ndarray:
    """(3,) x, y and turn by which a part moved in the hand, of a point of it, axes of the grasp frame.

    Args:
        before: ``T_tcp_obj``.
        after: The same, later.
        point_tcp: (3,) the point before, tcp frame, metres.
    """
    _, _, _, turn = object_displacement(before, after)[0]
    # The grasp frame's y and z are the tcp's reversed.
    x, y, _ = (after @ before.inverse()).apply(point_tcp) - point_tcp
    return np.array([x, -y, turn])


def _off(pose: Grasp, seen: Pose, point: np.ndarray, after: Pose, target: Target) -> np.ndarray:
    """(3,) x, y and turn of a placed part less those of its target, axes of the grasp frame at the target."""
    made, _ = twist_and_swing_between(seen, after)
    now = (after @ seen.inverse()).apply(point)
    off = np.array([now[0] - target.x, now[1] - target.y, 0.0])
    in_hand = Pose(position=np.zeros(3), quat_wxyz=pose.T_base_grasp.quat_wxyz).inverse().apply(off)
    return np.array([in_hand[0], in_hand[1], float(wrap_angle(np.asarray(made - target.theta)))])
