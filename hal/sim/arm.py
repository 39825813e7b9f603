"""The simulated Panda: an articulation that follows joint and straight-line motions."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch
from torch import Tensor

from hal.arm_state import ArmState, GraspOutcome
from hal.gripper import FRANKA_HAND
from hal.limits import ArmLimits, lowest_point
from hal.sim.world import SapienWorld
from hal.simulated import SimulatedArm, contact_fault, joint_motion_s
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.minimum_jerk import minimum_jerk_steps
from mskgrasp.core.panda_kinematics import forward, forward_pose, track
from tasks.robot.reflex import Reflex

SETTLE_S = 0.15
"""Settling time of the drives at the end of a motion, s."""
AIR_HZ = 125
"""Simulation steps a second while nothing can touch the empty hand."""
AIR_GAP = 0.02
"""Least distance of the empty hand from all below it in free air, m: at 0.4 m/s it crosses that in 50 ms."""
PAD_GAP = 0.004
"""Distance of the pads from a part between them in free air, m: more than the run-up of closing fingers."""
TABLE_GAP = 0.006
"""Least height of pads that pass a part in free air over the table and what lies beside, m."""
LOOK_S = 0.1
"""Time after which it is looked again whether parts that moved are at rest, s."""
STOP_CHECK_S = 0.02
"""Time between two checks whether a wait was stopped, s."""
_ARRIVED = 0.001
"""Greatest distance of fingers that have moved from where they were to go, m."""
_SAME_PLACE, _SAME_TURN = 1e-4, 1e-3
"""Differences of poses of the hand on a vertical line, m and rad: those of the kinematics' solutions."""


class _Met(Exception):
    """The hand has met what it was to touch."""


class SapienArm(SimulatedArm[SapienWorld]):
    """The Panda of a `SapienWorld`; a contact force over the reflex limit ends a motion."""

    def __init__(self, world: SapienWorld, limits: ArmLimits):
        super().__init__(world, limits)
        self._force = 0.0

    def _reset(self) -> None:
        super()._reset()
        self._force = 0.0

    def _state(self) -> ArmState:
        env = self._world.env
        qpos = env.agent.robot.get_qpos()[0].cpu().numpy().astype(np.float64)
        tcp = env.tcp_pose()
        return ArmState(
            joints=qpos[:7],
            T_base_tcp=Pose(
                position=tcp.position[0].cpu().numpy().astype(np.float64),
                quat_wxyz=tcp.quat_wxyz[0].cpu().numpy().astype(np.float64),
            ),
            gripper_width=float(qpos[7:9].sum()),
            timestamp_s=time.monotonic(),
        )

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        start = self._target()
        goal = torch.as_tensor(joints, dtype=torch.float64)
        seconds = joint_motion_s(float((goal - start).abs().max()), speed)
        self._follow(torch.stack([start, goal]), seconds)

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self._follow(*self._straight(T_base_tcp, speed))

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        try:
            self._follow(*self._straight(T_base_tcp, speed), limit=force)
        except _Met:
            met = self._state().T_base_tcp
            self._recover()  # the drives no longer press
            return met
        return None

    def _straight(self, T_base_tcp: Pose, speed: float) -> tuple[Tensor, float]:
        """Joint waypoints (k, 7) of the straight line to a pose, with its start, and its duration, s."""
        start = self._target()
        here = forward_pose(start.numpy())
        line, seconds = self._line(here, T_base_tcp, speed)
        # Half of torch's time for single poses.
        joints, error = track(line.as_matrix(), start.numpy())
        self._check_tracked(joints, float(error.max()), T_base_tcp)
        return torch.cat([start[None], torch.from_numpy(joints)]), seconds

    def _follow(self, waypoints: Tensor, seconds: float, *, limit: float | None = None) -> None:
        """Move along joint waypoints (k, 7), evenly spaced, with a minimum-jerk profile.

        A contact force over ``limit``, N, by default the reflex's, ends the motion with `_Met`.
        """
        motion = self._world.env.motion
        path = _interpolate(waypoints, torch.from_numpy(minimum_jerk_steps(motion.n_steps(seconds))))
        clear = self._clear(path)
        pressed, begin = self._pressed(), 0
        while begin < len(path):
            coarse = bool(clear[begin]) and self._world.at_rest()
            end = begin + int(np.argmin(np.append(clear[begin:] == clear[begin], False)))
            if clear[begin] and not coarse:
                end = min(end, begin + motion.n_steps(LOOK_S))
            with self._coarsely(coarse):
                every = self._world.physics.rate_hz // motion.rate_hz
                picked = [*range(begin + every - 1, end - 1, every), end - 1]
                pressed = self._follow_piece(path[picked], pressed, limit)
            begin = end
        self._pause(SETTLE_S, bool(clear[-1]))

    def _clear(self, path: Tensor) -> np.ndarray:
        """(n,) whether the hand is empty, and nothing can touch it, at joints (n, 7) of a motion.

        A part in the hand feels the steps: the longer they are, the farther it swings where friction barely
        holds it.
        """
        if self._force > 0:
            return np.zeros(len(path), dtype=bool)
        world, hands = self._world, forward(path)[0].numpy()
        lowest = (hands[:, 2, :3] @ FRANKA_HAND.corners.T).min(axis=1) + hands[:, 2, 3]
        clear = lowest > world.top() + AIR_GAP
        if not clear.all() and is_vertical(hands):
            reach = world.reach(Pose.from_matrix(hands[lowest.argmin()]))
            if reach is not None and reach + PAD_GAP <= float(world.env.motion.fingers().min()):
                clear |= lowest > world.top_beside() + TABLE_GAP
        return clear

    def _pressed(self) -> float:
        """Force on hand and part, N, before a motion with a held part."""
        # Pads that close on a groove press the part on the table; that eases as the hand rises.
        return float(np.linalg.norm(self._world.env.contacts.load(holding=True))) if self._force else 0.0

    def _follow_piece(self, path: Tensor, pressed: float, touch: float | None) -> float:
        """Follow joints (n, 7), one a step; return the force that the hand still presses with."""
        motion, contacts = self._world.env.motion, self._world.env.contacts
        reflex_force, holding = self._world.physics.reflex_force, self._force > 0
        limit = reflex_force if touch is None else touch
        reflex = Reflex(contacts, motion, holding=holding)

        def check(_: int) -> bool:
            nonlocal pressed
            force = float(reflex.force()[0])
            pressed = min(pressed, force) if reflex.full else pressed
            return self._stop.is_set() or force - pressed > limit

        if not motion.follow(path[:, None], check=check, check_every=1):
            raise contact_fault(reflex_force) if touch is None or self._stop.is_set() else _Met
        return pressed

    def _pause(self, seconds: float, clear: bool) -> None:
        """Let time pass; coarsely if nothing can touch the hand and no part moves."""
        motion = self._world.env.motion
        with self._coarsely(clear and self._world.at_rest()):
            motion.step(motion.n_steps(seconds))

    @contextmanager
    def _coarsely(self, coarse: bool) -> Iterator[None]:
        """If asked for, take long steps, in which parts at rest stay where they are."""
        if not coarse:
            yield
            return
        with self._world.env.motion.coarsely(AIR_HZ), self._world.parts_kept_still():
            yield

    def _target(self) -> Tensor:
        """(7,) drive targets, radians: a motion starts there, so that they do not jump."""
        drives = [joint._objs[0].drive_target for joint in self._world.env.agent.arm_joints]
        return torch.tensor(
            [float(np.asarray(value).reshape(-1)[0]) for value in drives], dtype=torch.float64
        )

    def _move_gripper(self, width: float) -> None:
        world, motion = self._world, self._world.env.motion
        lag, self._force = self._force / world.physics.finger_stiffness, 0.0
        motion.hold(False)
        # Pads that press have their targets far inside the part. With these they press as much, and leave it
        # at once instead of after the ramp to its surface.
        motion.set_fingers(motion.finger_target.clip(motion.fingers().min() - lag))
        goal, hand = width / 2, self._state().T_base_tcp
        clear = lowest_point(hand) > world.top() + AIR_GAP
        reach = world.reach(hand)
        if not clear and reach is not None and reach + PAD_GAP <= goal:
            if float(motion.fingers().min()) < reach + PAD_GAP:
                motion.move_fingers(reach + PAD_GAP, check=self._stop.is_set)
                self._pause(LOOK_S, False)
                reach = world.reach(hand)
            # The part may have followed them.
            clear = reach is not None and reach + PAD_GAP - _ARRIVED <= float(motion.fingers().min())
        if not self._stop.is_set():
            with self._coarsely(clear and world.at_rest()):
                motion.move_fingers(goal, check=self._stop.is_set)

    def _grasp(self, force: float) -> GraspOutcome:
        env = self._world.env
        env.agent.set_finger_force(force)
        state = self._state()
        reach = self._world.reach(state.T_base_tcp)
        # Fingers that are as near already, as those of a hand that holds the part, must not open.
        if reach is not None and reach + PAD_GAP < state.gripper_width / 2 and self._world.at_rest():
            with self._coarsely(True):
                env.motion.move_fingers(reach + PAD_GAP, check=self._stop.is_set)
        self._force = force
        env.motion.move_fingers(-MAX_OPENING / 2, force=force, check=self._stop.is_set)
        env.motion.hold(True)
        state = self._state()
        return GraspOutcome(width=state.gripper_width, holding=self.holds(state))

    def _wait(self, seconds: float) -> None:
        clear = bool(self._clear(self._target()[None])[0])
        for _ in range(max(1, round(seconds / STOP_CHECK_S))):
            if self._stop.is_set():
                return
            self._pause(STOP_CHECK_S, clear)

    def _recover(self) -> None:
        """Nothing to reset in a simulator; the drives restart from the current joints."""
        env = self._world.env
        joints = env.agent.robot.get_qpos()[:, :7].double()
        env.motion.set_arm(joints, torch.zeros_like(joints))


def _interpolate(waypoints: Tensor, share: Tensor) -> Tensor:
    """(steps, 7) joints at fractions in [0, 1] of evenly spaced waypoints (k, 7)."""
    where = share * (len(waypoints) - 1)
    index = where.floor().long().clamp(max=len(waypoints) - 2)
    rest = (where - index)[:, None]
    return waypoints[index] * (1 - rest) + waypoints[index + 1] * rest


def is_vertical(hands: np.ndarray) -> bool:
    """Whether poses (n, 4, 4) of a hand that points down lie straight above one another."""
    turned = np.abs(hands[:, :3, :3] - hands[:1, :3, :3]).max()
    aside = np.abs(hands[:, :2, 3] - hands[:1, :2, 3]).max()
    tilted = np.abs(hands[:, :2, 2]).max()
    return bool(max(turned, tilted) < _SAME_TURN and aside < _SAME_PLACE)
