"""Motions of the simulated Panda, step by step: straight lines, joint paths and the fingers' ramp.

The same motions serve the task, which runs whole attempts in batch, and the simulated cell, which
executes one command at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from mani_skill.envs.scene import ManiSkillScene
from sapien.physx import PhysxArticulationJoint

from mskgrasp.core.geometry import Array
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.settings import Physics
from tasks.robot.panda import GraspPanda
from tasks.scene.arrays import arrays_for
from tasks.scene.table_friction import TableFriction

STILL_FINGER = 2e-3
"""A finger slower than this, m/s, has stopped. Speeds are differences of positions: PhysX's
TGS solver reports the velocity of a pressed joint with the drive's impulse still in it."""
PEAK_ACCELERATION = 1.5
"""Peak acceleration of the hand on straight lines, m/s^2: the drives then overshoot by less than 0.4 mm."""
FINGER_TIMEOUT_S = 0.5
"""Time for which fingers that do not come to rest (the part slides through them) are waited for, s."""
FINGER_MASS = 0.015
"""Mass of a finger of the Panda without its motor, kg."""
CHECK_S = 0.02
"""Time between two checks of closing fingers, and of the part's speed, s. Fingers that press and did not move
for this long have closed."""


def run_up(physics: Physics) -> float:
    """Distance after which the lag of closing fingers is stationary, to a hundredth, m.

    The slowest pole of a finger's drive, a mass on a spring and a damper, decides it; where two poles are
    equal, that takes 6.6 of its times instead of 4.6.
    """
    mass = physics.finger_armature + FINGER_MASS
    half = physics.finger_damping / (2 * mass)
    rest = half**2 - physics.finger_stiffness / mass
    slowest = half if rest < 0 else physics.finger_stiffness / mass / (half + math.sqrt(rest))
    return 6.6 * physics.finger_speed / slowest if slowest > 0 else math.inf


def finger_lag(physics: Physics) -> float:
    """Stationary lag of a closing finger behind its ramp, m: its drive has no target speed."""
    return physics.finger_speed * physics.finger_damping / physics.finger_stiffness


def _mean_share(iterations: int) -> float:
    """Share of a step by which a target on a path is put back.

    A step holds its target, and its iterations are equal shares of it: aimed at the end of the step, a drive
    would be ahead of its path, the more the longer a step. Aimed at the mean, it is not.
    """
    return (1 - 1 / iterations) / 2


class PandaMotion:
    """Motions by drive targets, which advance the simulation.

    Args:
        scene: The scene of all n sub-scenes.
        agent: The Panda in them.
        physics: Rates, finger speed and force.
        friction: Friction of the part on the table, where the engine has none.
    """

    def __init__(
        self,
        scene: ManiSkillScene,
        agent: GraspPanda,
        physics: Physics,
        friction: TableFriction | None = None,
    ):
        self._scene = scene
        self._agent = agent
        self._physics = physics
        self.gpu = scene.gpu_sim_enabled
        self.arrays = arrays_for(scene)
        """Kind of array that all methods compute with and return; they take either kind."""
        self.n = scene.num_envs
        self._advance = scene.step if self.gpu else scene.px.step
        self._friction = friction
        self._articulation = agent.robot._objs[0]
        self._arm_drives = [joint._objs[0] for joint in agent.arm_joints]
        self._finger_drives = [joint._objs[0] for joint in agent.finger_joints]
        self.finger_target = self.arrays.full(self.n, MAX_OPENING / 2)
        self.watch: Callable[[float], None] | None = None
        """Called with the simulated time, s, every ``CHECK_S``."""
        self.seconds = 0.0
        """Simulated time, s."""
        self.rate_hz = physics.rate_hz
        """Current rate, simulation steps a second."""
        self._within = _mean_share(physics.position_iterations)
        self._watch_every = self.n_steps(CHECK_S)
        self._unwatched = 0
        self._commanded: Array = None

    def n_steps(self, seconds: float) -> int:
        """Simulation steps in a time at the current rate, at least one."""
        return max(1, round(seconds * self.rate_hz))

    @contextmanager
    def coarsely(self, rate_hz: int | None = None) -> Iterator[None]:
        """Simulate with a coarse rate while the context lasts, by default that of the physics settings."""
        fine = self.rate_hz
        self._set_rate(min(fine, rate_hz or self._physics.coarse_rate_hz))
        try:
            yield
        finally:
            self._set_rate(fine)

    def _set_rate(self, rate_hz: int) -> None:
        self.rate_hz = rate_hz
        self._watch_every = self.n_steps(CHECK_S)
        self._scene.timestep = 1 / rate_hz

    def hold(self, holding: bool) -> None:
        """Solve as finely as a part in the hand needs (`Physics.hold_iterations`), or as before its grasp.

        A contact is solved with the most iterations of its bodies. On a GPU they are those of the scene.
        """
        if self.gpu:
            return
        least = self._physics.position_iterations
        n = max(least, self._physics.hold_iterations) if holding else least
        self._articulation.set_solver_position_iterations(n)
        self._within = _mean_share(n)

    def fingers(self) -> Array:
        """(n, 2) measured distances of the fingers from the middle, m."""
        if self.gpu:
            return self._agent.robot.get_qpos()[:, 7:9]
        return self.arrays.of(self._articulation.qpos[None, 7:9])

    def gap(self) -> Array:
        """(n,) distance of the pads, m."""
        return self.fingers().sum(-1)

    def place(self, q: Array, width: Array | None = None) -> None:
        """Set the arm to joints (n, 7) at once, at rest, fingers open by ``width`` (n,) metres or fully."""
        xp, arrays = self.arrays.xp, self.arrays
        opening = arrays.full(self.n, MAX_OPENING) if width is None else arrays.of(width)
        fingers = xp.astype(opening, xp.float32) / 2
        q = arrays.of(q)
        qpos = xp.concat([xp.astype(q, xp.float32), xp.stack([fingers, fingers], axis=-1)], axis=-1)
        if self.gpu:
            self._agent.robot.set_qpos(qpos)
            self._agent.robot.set_qvel(xp.zeros_like(qpos))
            self._scene._gpu_apply_all()
            self._scene.px.gpu_update_articulation_kinematics()
            self._scene._gpu_fetch_all()
        else:
            self._articulation.qpos = np.asarray(qpos[0])
            self._articulation.qvel = np.zeros(9, np.float32)
        self.set_fingers(fingers)
        self._unwatched = 0
        if self._friction is not None:
            self._friction.reset()
        self.set_arm(q, xp.zeros_like(q))

    def set_arm(self, q: Array, qd: Array) -> None:
        """Drive targets of the arm: (n, 7) radians and radians a second."""
        q, qd = self.arrays.of(q), self.arrays.of(qd)
        self._commanded = q
        if self.gpu:
            robot, xp = self._agent.robot, self.arrays.xp
            robot.set_joint_drive_targets(xp.astype(q, xp.float32), self._agent.arm_joints)
            robot.set_joint_drive_velocity_targets(xp.astype(qd, xp.float32), self._agent.arm_joints)
            return
        for drive, place, rate in zip(self._arm_drives, q[0].tolist(), qd[0].tolist(), strict=True):
            drive.set_drive_target(place)
            drive.set_drive_velocity_target(rate)

    def set_fingers(self, target: Array) -> None:
        """Drive targets of both fingers: (n,) metres from the middle, negative to press."""
        self.finger_target = self.arrays.of(target)
        if self.gpu:
            pair = self.finger_target[:, None].expand(-1, 2)
            self._agent.robot.set_joint_drive_targets(pair, self._agent.finger_joints)
        else:
            self._drive_fingers(float(self.finger_target[0]))

    def run_fingers(self, hands: Array) -> None:
        """Give the fingers of some hands (n,) the stationary speed and lag of a ramp.

        A step has one target, which pulls a finger through its first half and brakes it through the second:
        where steps meet it is slower than in the mean, by the mean over a step of what the pull has added.
        """
        physics, xp = self._physics, self.arrays.xp
        lag, mass = finger_lag(physics), physics.finger_armature + FINGER_MASS
        slower = physics.finger_stiffness / mass / (12 * self.rate_hz**2)
        speed = physics.finger_speed * max(0.0, 1 - slower)
        hands = self.arrays.of(hands)
        if self.gpu:
            qvel = self._agent.robot.get_qvel().clone()
            qvel[:, 7:9] = xp.where(hands[:, None], -speed, qvel[:, 7:9])
            self._agent.robot.set_qvel(qvel)
            self._scene.px.gpu_apply_articulation_qvel()
        elif bool(hands[0]):
            qvel = self._articulation.qvel
            qvel[7:9] = -speed
            self._articulation.qvel = qvel
        self.set_fingers(xp.where(hands, self.finger_target - lag, self.finger_target))

    def _drive_fingers(self, target: float) -> None:
        for drive in self._finger_drives:
            drive.set_drive_target(target)

    def step(self, n_steps: int = 1) -> None:
        """Advance the simulation with the targets as they are."""
        if self.gpu:
            self._scene.px.gpu_apply_articulation_target_position()
            self._scene.px.gpu_apply_articulation_target_velocity()
        for _ in range(n_steps):
            if self._friction is not None:
                self._friction.apply()
            self._advance()
            self.seconds += 1 / self.rate_hz
            self._unwatched += 1
            if not self.gpu and self._unwatched >= self._watch_every:
                self._call_watch()
        if self.gpu:
            self._scene._gpu_fetch_all()
            if self._unwatched >= self._watch_every:
                self._call_watch()

    def _call_watch(self) -> None:
        self._unwatched = 0
        if self.watch is not None:
            self.watch(self.seconds)

    def arrive(self, frozen: Array) -> None:
        """Put arms that have come to a stop, but for the frozen ones (n,), exactly at their targets.

        The drives leave an arm some tens of micrometres short, the more the finer the steps: a joint turns
        in float32, and what a slow one turns in one iteration is rounded away. The real controller integrates
        its error away. Fingers stay as they are.
        """
        xp = self.arrays.xp
        stop = self.arrays.of(frozen)
        if self.gpu:
            robot = self._agent.robot
            qpos, qvel = robot.get_qpos().clone(), robot.get_qvel().clone()
            exact = xp.astype(self._commanded, xp.float32)
            qpos[:, :7] = xp.where(stop[:, None], qpos[:, :7], exact)
            qvel[:, :7] = xp.where(stop[:, None], qvel[:, :7], xp.zeros_like(exact))
            robot.set_qpos(qpos)
            robot.set_qvel(qvel)
            self._scene.px.gpu_apply_articulation_qpos()
            self._scene.px.gpu_apply_articulation_qvel()
            self._scene.px.gpu_update_articulation_kinematics()
            self._scene._gpu_fetch_all()
        elif not bool(stop[0]):
            qpos, qvel = self._articulation.qpos, self._articulation.qvel
            qpos[:7], qvel[:7] = self._commanded[0], 0
            self._articulation.qpos, self._articulation.qvel = qpos, qvel

    def follow(
        self,
        path: Array,
        *,
        check: Callable[[int], bool] | None = None,
        check_every: int = 4,
        frozen: Array | None = None,
    ) -> bool:
        """Follow joint targets, one a simulation step.

        Args:
            path: (steps, n, 7) radians, at the end of each step; it begins where the arms were sent before.
            check: Called every ``check_every`` steps with the index of the step; True ends the motion.
            check_every: Number of steps between two checks.
            frozen: (n,) bool, arms that stay where their targets are; read at every step.

        Returns:
            False where ``check`` ended the motion.
        """
        xp, arrays = self.arrays.xp, self.arrays
        path = arrays.of(path)
        # An arm that is frozen from the first step on stays where it was sent before.
        last = path[0] if self._commanded is None else self._commanded
        speed = (path - xp.concat([last[None], path[:-1]])) * self.rate_hz
        aims = path - self._within / self.rate_hz * speed
        still = xp.zeros_like(path[0])
        moving = [] if self.gpu else self._moving(aims[:, 0], speed[:, 0])
        stop = arrays.full(self.n, False) if frozen is None else arrays.of(frozen)
        if not self.gpu:
            self.set_arm(aims[0], speed[0])
        for i in range(len(path)):
            if self.gpu:
                last = xp.where(stop[:, None], last, path[i])
                self.set_arm(xp.where(stop[:, None], last, aims[i]), xp.where(stop[:, None], still, speed[i]))
            else:
                last = path[i]
                for drive, places, rates in moving:
                    drive.set_drive_target(places[i])
                    drive.set_drive_velocity_target(rates[i])
            self.step()
            if check is not None and i % check_every == check_every - 1 and check(i):
                self.set_arm(last, still)
                return False
        self.set_arm(last, still)
        return True

    def _moving(self, path: Array, speed: Array) -> list[tuple[PhysxArticulationJoint, list, list]]:
        """The joints that a path (steps, 7) moves, with its places and speeds (steps, 7) as plain numbers.

        An attempt has hundreds of steps; on a vertical line four joints stand still, and need no call.
        """
        moving = np.flatnonzero(np.asarray((path != path[:1]).any(0))).tolist()
        return [(self._arm_drives[j], path[:, j].tolist(), speed[:, j].tolist()) for j in moving]

    def move_fingers(
        self,
        target: float,
        *,
        force: float | None = None,
        check: Callable[[], bool] | None = None,
        frozen: Array | None = None,
    ) -> bool:
        """Ramp the fingers' targets to ``target`` (metres from the middle) and wait until they stop.

        A target inside the part keeps pressing with the drive's force limit.

        Args:
            target: Target of each finger, metres from the middle, negative to press.
            force: The drives' force limit, N; that of the physics settings by default.
            check: Called every few steps; True ends the motion, the fingers stay where they are.
            frozen: (n,) bool, hands whose fingers do not move.

        Returns:
            False where ``check`` ended the motion.
        """
        xp, arrays = self.arrays.xp, self.arrays
        speed, start = self._physics.finger_speed, self.finger_target
        way = target - start
        if frozen is not None:
            way = xp.where(arrays.of(frozen), xp.zeros_like(way), way)
        goal = start + way
        n_ramp = max(1, math.ceil(float(abs(way).max()) / speed * self.rate_hz + self._within))
        steps = np.arange(1, n_ramp + 1, dtype=np.float32) - self._within
        done = arrays.of(steps)[:, None] * speed / self.rate_hz
        ramp = start + xp.sign(way) * xp.minimum(done, abs(way))
        # A held part stops the fingers before their targets; wait until the drives press in full.
        lag = (force or self._physics.finger_force) / self._physics.finger_stiffness
        last = self.fingers()
        every = self.n_steps(CHECK_S)
        far = STILL_FINGER * every / self.rate_hz
        targets = None if self.gpu else ramp[:, 0].tolist()
        for i in range(n_ramp + self.n_steps(FINGER_TIMEOUT_S)):
            if i < n_ramp and targets is not None:
                self._drive_fingers(targets[i])
            elif i < n_ramp:
                self.set_fingers(ramp[i])
            self.step()
            if i % every != every - 1:
                continue
            if check is not None and check():
                self.set_fingers(self.gap() / 2)
                return False
            fingers = self.fingers()
            still = (abs(fingers - last) < far).all(-1)
            last = fingers
            middle = fingers.sum(-1) / 2
            ahead = ramp[min(i, n_ramp - 1)] - middle
            # Fingers that open press the other way until the target has passed them: they are not done.
            pressing = xp.where(way == 0, abs(ahead), ahead * xp.sign(way)) > lag
            arrived = abs(middle - goal) < 1e-3
            if bool((still & (pressing | arrived)).all()):
                break
        self.set_fingers(goal)
        return True
