"""Simulation of the cell: the arm follows joint paths, the fingers move, the parts obey physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from hal.limits import lowest_point
from hal.mujoco.config import MujocoPhysics
from hal.mujoco.panda import FINGER_STIFFNESS, FINGERS
from hal.mujoco.scene import build_model
from hal.simulated import WATCH_S
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import forward_pose
from mskgrasp.parts import Part
from mskgrasp.parts.hulls import hull_corners

NATURAL_RATE = 100.0
"""Natural frequency of the arm's controller, rad/s: it is critically damped, knows the arm's inertia
as the real one does, and follows a path to 0.1 mm."""
SETTLE_S = 0.05
"""Time in which the arm comes to rest at the end of a motion, s: five times that of the controller."""
REFLEX_S = 0.024
"""The force on the hand that a reflex sees is the mean over this time, s, as in the SAPIEN cell."""
MOVE_FORCE = 20.0
"""Greatest force of the fingers while they hold nothing, N."""
STILL_FINGER = 2e-3
"""A finger slower than this, m/s, has met what it holds."""
FINGER_CHECK_S = 0.02
"""Time between two measurements of that speed, s."""
FINGER_TIMEOUT_S = 0.5
"""Greatest time to wait for fingers that never come to rest, s."""
AIR = 0.01
"""A hand at least this much over all parts moves through air, m."""
POINT = 5e-4
"""A contact of this extent is a single point, m: pieces of a pad that overlap a tip by 30 um meet it in
points up to 0.35 mm apart."""
_PART = 4
_BLOCK = 8
"""Steps of a path between two checks for parts near the hand."""
_REST_SPEED = (1e-3, 1e-2)
"""A part slower than this is at rest, m/s and rad/s."""
_REST_S = 0.06
"""Time for which it must have been: a part that rocks stands still at each turning point."""
_SETTLING_S = 2.0
"""Time that parts have to come to rest after they were placed, s."""


@dataclass(frozen=True, kw_only=True)
class _Path:
    """Joints (k, 7) at the steps of a motion that starts and ends at rest, and their derivatives."""

    joints: np.ndarray
    speeds: np.ndarray
    accelerations: np.ndarray

    @classmethod
    def through(cls, joints: np.ndarray, step_s: float) -> _Path:
        speeds = np.gradient(joints, step_s, axis=0)
        speeds[[0, -1]] = 0
        return cls(joints=joints, speeds=speeds, accelerations=np.gradient(speeds, step_s, axis=0))


class Simulation:
    """A cell with parts on its table, all at rest.

    Args:
        physics: Settings.
        parts: The first is the one that is grasped.
        poses: ``T_base_obj`` of each.
        home: (7,) joints of the arm, radians.
        table_motion: Motion of the table from where it is stated, in the base; None for none.
    """

    def __init__(
        self,
        physics: MujocoPhysics,
        parts: Sequence[Part],
        poses: Sequence[Pose],
        home: np.ndarray,
        table_motion: Pose | None = None,
    ):
        self.physics = physics
        self.parts = tuple(parts)
        self.model = build_model(physics, parts, table_motion)
        self.data = mujoco.MjData(self.model)
        self.step_s = physics.step_s
        self._corners = [np.concatenate(hull_corners(part)) for part in parts]
        data = self.data
        data.qpos[:9] = [*home, MAX_OPENING / 2, MAX_OPENING / 2]
        for i, pose in enumerate(poses):
            data.qpos[self._rows(i)] = pose.as_vector()
        self._opening = MAX_OPENING
        self.force: float | None = None
        """Force of the grip, N; None while the hand is to hold nothing."""
        self._limit_fingers(MOVE_FORCE)
        bodies = self.model.geom_bodyid
        self._finger_geoms = [np.flatnonzero(bodies == self.model.body(name).id) for name in FINGERS]
        self._sides = np.zeros(self.model.ngeom, dtype=int)
        """A number for every shape, whose sum over a contact says what it is between."""
        self._sides[bodies == self.model.body("part0").id] = _PART
        for number, own in enumerate(self._finger_geoms, start=1):
            self._sides[own] = number
        self.target = np.array(home, dtype=float)
        """(7,) commanded joints, radians: a motion starts there."""
        self._forces = np.zeros((self.n_steps(REFLEX_S), 3))
        self._sum = np.zeros(3)
        self._row = 0
        self._measured = 0
        self._wanted = np.zeros(self.model.nv)
        self._torque = np.zeros(self.model.nv)
        self.watch: Callable[[], None] | None = None
        """Called every `WATCH_S`; None: nothing is."""
        self._unwatched = 0
        self._steps = self._quiet = 0
        self._settle()

    @property
    def joints(self) -> np.ndarray:
        """(7,) radians."""
        return self.data.qpos[:7].copy()

    @property
    def width(self) -> float:
        """Distance of the pads, metres."""
        return float(self.data.qpos[7:9].sum())

    def part_pose(self, number: int = 0) -> Pose:
        """``T_base_obj`` of a part."""
        return Pose.from_vector(self.data.qpos[self._rows(number)].copy())

    def n_steps(self, seconds: float) -> int:
        """Simulation steps in a time, at least one."""
        return max(1, round(seconds / self.step_s))

    # ------------------------------------------------------------------ motions

    def follow(self, joints: np.ndarray, *, stop: Callable[[], bool], limit: float | None = None) -> bool:
        """Move the arm along a path and let it come to rest.

        Where the hand is over all parts, and these are at rest, nothing can happen: the arm is placed along
        its path and the parts stay as they are.

        Args:
            joints: (k, 7) radians, a step apart, k > 2; the first are the `target`.
            stop: Read every few steps; True ends the motion.
            limit: Contact force that ends it, N; by default the reflex's.

        Returns:
            False where the contact force ended it.
        """
        limit = self.physics.reflex_force if limit is None else limit
        path = _Path.through(joints, self.step_s)
        free = self._in_air(path.joints)
        pressed = self._pressed()
        last = len(path.joints) - 1
        simulated = True
        for start in range(0, last, _BLOCK):
            end = min(start + _BLOCK, last)
            if stop():
                break
            if free[start] and free[end] and self._at_rest():
                self._place(path, end)
                self._call_watch(end - start)
                simulated, pressed = False, 0.0
                continue
            simulated = True
            for k in range(start, end):
                self._step(path.joints[k], path.speeds[k], path.accelerations[k])
                self.target = path.joints[k + 1]
                load = self.load()
                if self._measured >= len(self._forces):
                    pressed = min(pressed, load)
                if load - pressed > limit:
                    return False
        if simulated:
            self.stand(SETTLE_S, stop=lambda: False)
        else:
            self.data.qvel[:7] = 0  # also where it was stopped on its way
        return True

    def stand(self, seconds: float, *, stop: Callable[[], bool]) -> None:
        """Simulate a time in which the arm holds its target."""
        still = np.zeros(7)
        for k in range(self.n_steps(seconds)):
            if k % _BLOCK == 0 and stop():
                return
            self._step(self.target, still, still)

    def move_fingers(self, width: float, *, force: float | None, stop: Callable[[], bool]) -> None:
        """Move the pads to a distance, or until they hold something.

        Args:
            width: Distance of the pads, metres; negative to press on what they meet.
            force: Force of the grip, N; None where nothing is to be held.
            stop: Read every few steps; True ends the motion.
        """
        self.force = force
        limit = MOVE_FORCE if force is None else force
        # Fingers that hold something stand where it is, not where they press.
        lag = float(self.model.actuator_forcerange[7, 1]) / FINGER_STIFFNESS
        start = min(max(self._opening, self.width - lag), self.width + lag)
        self._limit_fingers(limit)
        speed, still, way = 2 * self.physics.finger_speed, np.zeros(7), width - start
        n_ramp = math.ceil(abs(way) / speed / self.step_s)
        every, before, quiet = self.n_steps(FINGER_CHECK_S), self.width, 0
        for k in range(1, n_ramp + self.n_steps(FINGER_TIMEOUT_S) + 1):
            self._opening = start + way * min(1.0, k / max(1, n_ramp))
            self._step(self.target, still, still)
            if k % every:
                continue
            if stop():
                self._opening = self.width
                return
            now = self.width
            ahead = (self._opening - now) * math.copysign(1, way)
            done = abs(now - width) < 1e-3 or ahead * FINGER_STIFFNESS > limit
            slow = abs(now - before) < 2 * STILL_FINGER * every * self.step_s
            before, quiet = now, quiet + 1 if done and slow else 0
            if quiet >= 2:
                break
        self._opening = width

    def halt(self) -> None:
        """Make the arm stand where it is, so that it no longer presses on what it has met."""
        self.target = self.joints
        self.stand(SETTLE_S, stop=lambda: False)

    # ------------------------------------------------------------------ contacts

    def load(self) -> float:
        """Mean contact force on the hand with its fingers over the last `REFLEX_S`, N.

        Once the hand grips, a part that it touches counts as one with it, so that the grip cancels.
        """
        return float(np.linalg.norm(self._sum)) / len(self._forces)

    def grip(self) -> tuple[np.ndarray, float]:
        """Forces (2,) of both fingers on the part, N, and depth of a finger's overlap with it, metres."""
        model, data = self.model, self.data
        part = model.body("part0").id
        fingers = [model.body(name).id for name in FINGERS]
        total, deepest, one = np.zeros((2, 3)), 0.0, np.zeros(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            bodies = model.geom_bodyid[list(contact.geom)].tolist()
            touching = [number for number, finger in enumerate(fingers) if finger in bodies]
            if part not in bodies or not touching:
                continue
            mujoco.mj_contactForce(model, data, i, one)
            sign = 1.0 if bodies[1] == part else -1.0
            total[touching[0]] += sign * contact.frame.reshape(3, 3).T @ one[:3]
            deepest = max(deepest, -contact.dist)
        return np.linalg.norm(total, axis=1), deepest

    def _measure_force(self) -> None:
        sensed = self.data.sensordata.reshape(-1, 4)
        row = self._forces[self._row]
        self._sum -= row
        gripped = self.force is not None and sensed[-1, 0] > 0
        row[:] = sensed[: -1 if gripped else -2, 1:].sum(axis=0)
        self._sum += row
        self._row = (self._row + 1) % len(self._forces)
        self._measured += 1

    def _set_torsion(self) -> None:
        """Make each finger resist turning by the radius of its patch where it touches the part at one point.

        Contacts of several points resist turning by their distances. With the patch about each of them, too,
        pads would hold a part by a strip of a millimetre eight times as firmly as even pressure does.
        """
        contact = self.data.contact
        between = self._sides[contact.geom].sum(axis=1)
        for number, own in enumerate(self._finger_geoms, start=1):
            points = contact.pos[between == _PART + number]
            single = len(points) < 2 or float(np.abs(points - points[0]).max()) < POINT
            self.model.geom_condim[own] = 4 if single else 3

    def _forget_forces(self) -> None:
        """Begin a new mean, which counts steps not yet measured as free of force."""
        self._forces[:] = 0
        self._sum[:] = 0
        self._measured = 0

    # ------------------------------------------------------------------ steps

    def _step(self, joints: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray) -> None:
        """Advance by a step, the arm controlled towards a state by the torques of its dynamics."""
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        self._wanted[:7] = (
            accelerations
            + 2 * NATURAL_RATE * (speeds - data.qvel[:7])
            + NATURAL_RATE**2 * (joints - data.qpos[:7])
        )
        mujoco.mj_mulM(model, data, self._torque, self._wanted)
        data.ctrl[:7] = self._torque[:7] + data.qfrc_bias[:7]
        data.ctrl[7] = self._opening
        mujoco.mj_step2(model, data)
        self._measure_force()
        self._steps += 1
        if self._steps % _BLOCK == 0:
            self._quiet = self._quiet + _BLOCK if self._still() else 0
        if data.sensordata[-4] > 0:  # contacts of hand and part
            self._set_torsion()
        self._call_watch(1)

    def _call_watch(self, n_steps: int) -> None:
        """Count the steps that have passed, and call `watch` when it is due."""
        self._unwatched += n_steps
        if self.watch is not None and self._unwatched * self.step_s >= WATCH_S:
            self._unwatched = 0
            self.watch()

    def _place(self, path: _Path, k: int) -> None:
        """Put the arm at a step of a path."""
        data = self.data
        data.qpos[:7], data.qvel[:7] = path.joints[k], path.speeds[k]
        data.qvel[7:9] = 0
        data.qacc_warmstart[:] = 0
        self.target = path.joints[k]
        self._forget_forces()

    def _pressed(self) -> float:
        """Force that the grip itself puts on hand and part, N; begins a new mean.

        Pads that close on a groove press the part on the table; that eases as the hand rises.
        """
        pressed = self.load() if self.force is not None else 0.0
        self._forget_forces()
        return pressed

    def _in_air(self, joints: np.ndarray) -> np.ndarray:
        """(k,) whether the hand, at the steps of a path where a block begins or ends, is over all parts."""
        free = np.zeros(len(joints), dtype=bool)
        if self.force is not None:
            return free
        looks = np.unique([*range(0, len(free), _BLOCK), len(free) - 1])
        poses = forward_pose(joints[looks])
        top = max(
            float(self.part_pose(i).apply(corners)[:, 2].max()) for i, corners in enumerate(self._corners)
        )
        heights = [
            lowest_point(Pose(position=position, quat_wxyz=quat))
            for position, quat in zip(poses.position, poses.quat_wxyz, strict=True)
        ]
        free[looks] = np.array(heights) > top + AIR
        return free

    def _at_rest(self) -> bool:
        """Whether the parts have been at rest for `_REST_S`."""
        return self._quiet >= self.n_steps(_REST_S) and self._still()

    def _still(self) -> bool:
        speeds = self.data.qvel[9:].reshape(-1, 2, 3)
        return bool((np.abs(speeds).max(axis=(0, 2)) < _REST_SPEED).all())

    def _settle(self) -> None:
        """Wait until the parts have been at rest for a while."""
        quiet, enough = 0, self.n_steps(_REST_S)
        for _ in range(self.n_steps(_SETTLING_S)):
            self.stand(self.step_s, stop=lambda: False)
            quiet = quiet + 1 if self._still() else 0
            if quiet >= enough:
                self._quiet = enough
                return

    def _limit_fingers(self, force: float) -> None:
        self.model.actuator_forcerange[7] = [-force, force]

    def _rows(self, number: int) -> slice:
        """Rows of a part's pose in the joint positions."""
        return slice(9 + 7 * number, 16 + 7 * number)
