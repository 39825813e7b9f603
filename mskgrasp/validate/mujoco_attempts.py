"""Attempts of a validation in MuJoCo: the same part, start and grasp as in the task, by another engine."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from hal.mujoco import MujocoPhysics
from hal.mujoco.simulation import Simulation
from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.grasp import MAX_OPENING, MIN_GAP, Grasp, lowest_grasp_z, object_displacement
from mskgrasp.core.minimum_jerk import minimum_jerk_duration, minimum_jerk_steps
from mskgrasp.core.panda_kinematics import forward_pose, top_down
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part, read_part
from mskgrasp.parts.hulls import hull_corners
from tasks.attempt.attempt import SPEED_WINDOW_S
from tasks.attempt.outcome import MAX_DRIFT, MAX_TURN, MIN_PAD_FORCE, Observed, judge
from tasks.robot.motion import PEAK_ACCELERATION


def mujoco_physics(physics: Physics) -> MujocoPhysics:
    """MuJoCo's settings with the friction, patch, finger and reflex of the task's."""
    common = MujocoPhysics.model_fields.keys() & Physics.model_fields.keys()
    return MujocoPhysics(**physics.model_dump(include=set(common)))


def try_grasp(part: Part, pose: np.ndarray, grasp: np.ndarray, physics: Physics) -> dict[str, np.ndarray]:
    """One attempt: descend, close, lift, hold, judge.

    Args:
        part: The part, read from its folder.
        pose: (7,) ``T_base_obj`` at the start.
        grasp: (4,) x, y, z, theta, base frame.
        physics: Speeds, times and forces; both engines share them.

    Returns:
        success, failure, settled, displacement (4,) and tilt (NaN where not successful), penetration, fastest
        (NaN: it is not watched), seconds of simulated time.
    """
    start = Pose.from_vector(pose)
    top = float(start.apply(np.concatenate(hull_corners(part)))[:, 2].max())
    above = max(0.0, top + lowest_grasp_z(0.0) + physics.approach_clearance - float(grasp[2]))
    simulation = Simulation(mujoco_physics(physics), [part], [start], _joints(_raised(grasp, above)))
    rest = simulation.part_pose()
    drift, turn = pose_distance(start, rest)
    settled = drift <= MAX_DRIFT and turn <= MAX_TURN
    met = settled and _move(simulation, grasp, above, 0.0, physics.descend_speed)
    held, deepest = False, 0.0
    speed = np.nan
    if met:
        simulation.move_fingers(-MAX_OPENING, force=physics.finger_force, stop=_never)
        forces, deepest = simulation.grip()
        held = bool((forces > MIN_PAD_FORCE).all()) and simulation.width > MIN_GAP
    if held and _move(simulation, grasp, 0.0, physics.lift_height, physics.lift_speed):
        simulation.stand(physics.hold_s - SPEED_WINDOW_S, stop=_never)
        before = _in_hand(simulation)
        simulation.stand(SPEED_WINDOW_S, stop=_never)
        speed = float(np.linalg.norm(_in_hand(simulation).position - before.position)) / SPEED_WINDOW_S
    forces, now = simulation.grip()
    moved = simulation.part_pose().position - rest.position
    success, failure = judge(
        Observed(
            settled=np.array([settled]),
            collided=np.array([settled and not met]),
            held_closed=np.array([held]),
            pads_touch=np.array([(forces > MIN_PAD_FORCE).all()]),
            gap=np.array([simulation.width]),
            rise=np.array([moved[2] / physics.lift_height]),
            relative_speed=np.array([speed]),
            penetration=np.array([max(deepest, now)]),
            wandered=np.array([np.hypot(*moved[:2])]),
        )
    )
    displacement, tilt = object_displacement(
        Grasp.from_vector(grasp).T_base_tcp.inverse() @ rest, _in_hand(simulation)
    )
    nothing = not success[0]
    return dict(
        success=success[0],
        failure=failure[0],
        settled=np.asarray(settled),
        displacement=np.full(4, np.nan) if nothing else displacement,
        tilt=np.asarray(np.nan if nothing else tilt),
        penetration=np.asarray(max(deepest, now)),
        fastest=np.asarray(np.nan),
        seconds=np.asarray(simulation.data.time),
    )


def try_grasps(
    folder: Path, poses: np.ndarray, grasps: np.ndarray, physics: Physics
) -> dict[str, np.ndarray]:
    """Attempts (n) from starts (n, 7) with grasps (n, 4), as `try_grasp`, and processor times."""
    part = read_part(folder)
    rows = []
    for pose, grasp in zip(poses, grasps, strict=True):
        began = time.process_time()
        row = try_grasp(part, pose.astype(np.float64), grasp.astype(np.float64), physics)
        rows.append(row | {"cpu_seconds": np.asarray(time.process_time() - began)})
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _move(simulation: Simulation, grasp: np.ndarray, start: float, goal: float, speed: float) -> bool:
    """Move between heights over a grasp; False where the hand met something."""
    distance = abs(goal - start)
    if distance == 0:
        return True
    seconds = minimum_jerk_duration(distance, speed, PEAK_ACCELERATION)
    shares = np.concatenate([[0.0], minimum_jerk_steps(max(2, simulation.n_steps(seconds)))])
    heights = start + shares * (goal - start)
    path = np.tile(grasp, (len(heights), 1))
    path[:, 2] += heights
    return simulation.follow(_joints(path), stop=_never)


def _joints(grasps: np.ndarray) -> np.ndarray:
    joints, reachable = top_down(grasps)
    if not np.all(reachable):
        raise ValueError(f"grasp {grasps.tolist()} is out of the arm's reach")
    return joints


def _raised(grasp: np.ndarray, height: float) -> np.ndarray:
    return grasp + np.array([0.0, 0.0, height, 0.0])


def _in_hand(simulation: Simulation) -> Pose:
    return forward_pose(simulation.joints).inverse() @ simulation.part_pose()


def _never() -> bool:
    return False
