"""Motions of the simulated Panda, step by step: straight lines, joint paths and the fingers' ramp.

The same motions serve the task, which runs whole attempts in batch, and the simulated cell, which
executes one command at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import torch
from mani_skill.envs.scene import ManiSkillScene
from torch import Tensor

from mskgrasp.grasp import MAX_OPENING
from mskgrasp.settings import Physics
from tasks.panda import GraspPanda

STILL_FINGER = 2e-3
"""A finger slower than this, m/s, has met what it holds. Speeds are differences of positions: PhysX's
TGS solver reports the velocity of a pressed joint with the drive's impulse still in it."""
STILL_S = 0.03
"""Fingers that did not move for this long have closed, s."""
PEAK_ACCELERATION = 1.5
"""Of the hand on straight lines, m/s^2: the drives then overshoot by less than 0.4 mm."""
FINGER_TIMEOUT_S = 0.5
"""Fingers that never come to rest (the part slides through them) are given up after this, s."""
FINGER_MASS = 0.015
"""Of a finger of the Panda without its motor, kg."""
CHECK_S = 0.02
"""Time between two looks at fingers that close, and at the part's speed, s."""


def ease(n_steps: int, device: torch.device) -> Tensor:
    """(n_steps,) fractions of a path from just above 0 to 1, without speed or acceleration at its ends.

    The minimum-jerk profile (Flash and Hogan 1985, equation 5): with an acceleration at the end the arm
    would overshoot by its inertia over its stiffness, more than the clearance between pads and table.
    """
    t = torch.arange(1, n_steps + 1, dtype=torch.float64, device=device) / n_steps
    return t**3 * (10 - 15 * t + 6 * t**2)


def ease_duration(distance: float, peak_speed: float, peak_acceleration: float) -> float:
    """Seconds that `ease` needs over a distance without passing a peak speed and a peak acceleration.

    The profile's peaks are 15/8 of the mean speed and 10/sqrt(3) distance / time^2. A short way needs the
    second bound: at full speed its acceleration would make the arm overshoot.
    """
    return max(
        15 / 8 * distance / peak_speed, math.sqrt(10 / math.sqrt(3) * distance / peak_acceleration), 0.02
    )


def run_up(physics: Physics) -> float:
    """Way after which closing fingers lag behind their ramp as they always will, to a hundredth, m.

    The slowest pole of a finger's drive, a mass on a spring and a damper, tells how soon; where two poles are
    equal, that takes 6.6 of its times instead of 4.6.
    """
    mass = physics.finger_armature + FINGER_MASS
    half = physics.finger_damping / (2 * mass)
    rest = half**2 - physics.finger_stiffness / mass
    slowest = half if rest < 0 else physics.finger_stiffness / mass / (half + math.sqrt(rest))
    return 6.6 * physics.finger_speed / slowest if slowest > 0 else math.inf


class PandaMotion:
    """Writes drive targets and advances the simulation.

    Args:
        scene: The scene of all n sub-scenes.
        agent: The Panda in them.
        physics: Rate, finger speed and force.
        coarse_hz: Simulation steps a second where it is told to be coarse.
    """

    def __init__(self, scene: ManiSkillScene, agent: GraspPanda, physics: Physics, coarse_hz: int):
        self._scene = scene
        self._agent = agent
        self._physics = physics
        self._coarse_hz = coarse_hz
        self.gpu = scene.gpu_sim_enabled
        self.device = agent.device
        self.n = scene.num_envs
        self._arm_drives = [joint._objs[0] for joint in agent.arm_joints]
        self._finger_drives = [joint._objs[0] for joint in agent.finger_joints]
        self.finger_target = torch.full((self.n,), MAX_OPENING / 2, device=self.device)
        self.watch: Callable[[float], None] | None = None
        """Told of the simulated time, s, every ``CHECK_S``."""
        self.seconds = 0.0
        """Simulated so far."""
        self.rate_hz = physics.rate_hz
        """Simulation steps a second, now."""
        self._unwatched = 0
        self._driven: list[tuple[float, float] | None] = [None] * 7
        self._commanded: Tensor | None = None

    def n_steps(self, seconds: float) -> int:
        """Simulation steps in a time at the rate of now, at least one."""
        return max(1, round(seconds * self.rate_hz))

    @contextmanager
    def coarsely(self) -> Iterator[None]:
        """Simulates with the coarse rate while the context lasts."""
        fine = self.rate_hz
        self._set_rate(self._coarse_hz)
        try:
            yield
        finally:
            self._set_rate(fine)

    def _set_rate(self, rate_hz: int) -> None:
        self.rate_hz = rate_hz
        self._scene.timestep = 1 / rate_hz

    def place(self, q: Tensor, width: Tensor | None = None) -> None:
        """Puts the arm at joints (n, 7) at once, at rest, fingers open by ``width`` (n,) metres or wholly."""
        opening = torch.full((self.n,), MAX_OPENING, device=self.device) if width is None else width
        fingers = (opening.to(torch.float32) / 2)[:, None].expand(-1, 2)
        qpos = torch.cat([q.to(torch.float32), fingers], dim=-1)
        self._agent.robot.set_qpos(qpos)
        self._agent.robot.set_qvel(torch.zeros_like(qpos))
        if self.gpu:
            self._scene._gpu_apply_all()
            self._scene.px.gpu_update_articulation_kinematics()
            self._scene._gpu_fetch_all()
        self.set_fingers(fingers[:, 0])
        self._driven = [None] * 7  # others may have written to the drives since
        self._unwatched = 0
        self.set_arm(q, torch.zeros_like(q))

    def set_arm(self, q: Tensor, qd: Tensor) -> None:
        """Drive targets of the arm: (n, 7) radians and radians a second."""
        self._commanded = q
        if self.gpu:
            robot = self._agent.robot
            robot.set_joint_drive_targets(q.to(torch.float32), self._agent.arm_joints)
            robot.set_joint_drive_velocity_targets(qd.to(torch.float32), self._agent.arm_joints)
        else:
            self._drive_arm(list(zip(q[0].tolist(), qd[0].tolist(), strict=True)))

    def _drive_arm(self, targets: list[tuple[float, float]], joints: Iterable[int] = range(7)) -> None:
        # Four joints stand still on a vertical line, and a call costs a fiftieth of a simulation step.
        for number in joints:
            target = targets[number]
            if target != self._driven[number]:
                self._arm_drives[number].set_drive_target(target[0])
                self._arm_drives[number].set_drive_velocity_target(target[1])
                self._driven[number] = target

    def set_fingers(self, target: Tensor) -> None:
        """Drive targets of both fingers: (n,) metres from the middle, negative to press."""
        self.finger_target = target
        if self.gpu:
            pair = target[:, None].expand(-1, 2)
            self._agent.robot.set_joint_drive_targets(pair, self._agent.finger_joints)
        else:
            self._drive_fingers(float(target[0]))

    def run_fingers(self, hands: Tensor) -> None:
        """Makes the fingers of some hands (n,) close as they would long after a ramp began.

        They lag behind their targets by damping * speed / stiffness, less what they move in the mean between
        a step's target, which it holds, and the solver's iterations, equal shares of the step.
        """
        speed, physics = self._physics.finger_speed, self._physics
        within = (1 - 1 / physics.position_iterations) / (2 * self.rate_hz)
        lag = speed * max(0.0, physics.finger_damping / physics.finger_stiffness - within)
        qvel = self._agent.robot.get_qvel().clone()
        qvel[:, 7:9] = torch.where(hands[:, None], -speed, qvel[:, 7:9])
        self._agent.robot.set_qvel(qvel)
        if self.gpu:
            self._scene.px.gpu_apply_articulation_qvel()
        self.set_fingers(torch.where(hands, self.finger_target - lag, self.finger_target))

    def _drive_fingers(self, target: float) -> None:
        for drive in self._finger_drives:
            drive.set_drive_target(target)

    def step(self, n_steps: int = 1) -> None:
        """Advances the simulation with the targets as they are."""
        if self.gpu:
            self._scene.px.gpu_apply_articulation_target_position()
            self._scene.px.gpu_apply_articulation_target_velocity()
        watch_every = self.n_steps(CHECK_S)
        for _ in range(n_steps):
            self._scene.step()
            self.seconds += 1 / self.rate_hz
            self._unwatched += 1
            if not self.gpu and self._unwatched >= watch_every:
                self._look()
        if self.gpu:
            self._scene._gpu_fetch_all()
            if self._unwatched >= watch_every:
                self._look()

    def _look(self) -> None:
        self._unwatched = 0
        if self.watch is not None:
            self.watch(self.seconds)

    def follow(
        self,
        path: Tensor,
        *,
        check: Callable[[int], bool] | None = None,
        check_every: int = 4,
        frozen: Tensor | None = None,
    ) -> bool:
        """Follows joint targets, one a simulation step.

        Args:
            path: (steps, n, 7) radians.
            check: Called every ``check_every`` steps with the index of the step; True ends the motion.
            check_every: How often, steps.
            frozen: (n,) bool, arms that stay where their targets are; read at every step.

        Returns:
            False where ``check`` ended the motion.
        """
        rate = self.rate_hz
        speed = torch.zeros_like(path)
        speed[1:] = (path[1:] - path[:-1]) * rate
        # One environment: plain numbers, once; a tensor a step would cost as much as the physics.
        rows, moving = None, range(7)
        if not self.gpu:
            pairs = torch.stack([path[:, 0], speed[:, 0]], dim=-1)
            moving = (pairs != pairs[0]).any(dim=-1).any(dim=0).nonzero()[:, 0].tolist()
            rows = [list(map(tuple, row)) for row in pairs.tolist()]
        still = torch.zeros_like(path[0])
        # An arm that is frozen from the first step on stays where it was sent before.
        last = path[0] if self._commanded is None else self._commanded
        for i in range(len(path)):
            if rows is not None:
                self._drive_arm(rows[i], moving if i else range(7))
                last = path[i]
            else:
                stop = torch.zeros(self.n, dtype=torch.bool, device=self.device) if frozen is None else frozen
                last = torch.where(stop[:, None], last, path[i])
                self.set_arm(last, torch.where(stop[:, None], still, speed[i]))
            self.step()
            if check is not None and i % check_every == check_every - 1 and check(i):
                self.set_arm(last, still)
                return False
        self.set_arm(last, still)
        return True

    def move_fingers(
        self,
        target: float,
        *,
        force: float | None = None,
        check: Callable[[], bool] | None = None,
        frozen: Tensor | None = None,
    ) -> bool:
        """Ramps the fingers' targets to ``target`` (metres from the middle) and waits until they stop.

        A target inside the part keeps pressing with the drive's force limit.

        Args:
            target: Of each finger, negative to press.
            force: The drives' force limit, N; that of the physics settings by default.
            check: Asked every few steps; True ends the motion, the fingers stay where they are.
            frozen: (n,) bool, hands whose fingers do not move.

        Returns:
            False where ``check`` ended the motion.
        """
        speed, start = self._physics.finger_speed, self.finger_target
        way = target - start
        if frozen is not None:
            way = torch.where(frozen, torch.zeros_like(way), way)
        goal = start + way
        n_ramp = max(1, math.ceil(float(way.abs().max()) / speed * self.rate_hz))
        done = torch.arange(1, n_ramp + 1, device=self.device)[:, None] * speed / self.rate_hz
        ramp = start + way.sign() * torch.minimum(done, way.abs())
        quiet = torch.zeros(self.n, dtype=torch.int64, device=self.device)
        # A held part stops the fingers before their targets; wait until the drives press in full.
        lag = (force or self._physics.finger_force) / self._physics.finger_stiffness
        last = self._agent.robot.get_qpos()[:, 7:9]
        every = self.n_steps(CHECK_S)
        far = STILL_FINGER * every / self.rate_hz
        rows = None if self.gpu else ramp[:, 0].tolist()
        for i in range(n_ramp + self.n_steps(FINGER_TIMEOUT_S)):
            if i < n_ramp and rows is not None:
                self._drive_fingers(rows[i])
            elif i < n_ramp:
                self.set_fingers(ramp[i])
            self.step()
            if i % every != every - 1:
                continue
            if check is not None and check():
                self.set_fingers(self._agent.robot.get_qpos()[:, 7:9].mean(dim=-1))
                return False
            fingers = self._agent.robot.get_qpos()[:, 7:9]
            still = ((fingers - last).abs() < far).all(dim=-1)
            last = fingers
            middle = fingers.mean(dim=-1)
            ahead = ramp[min(i, n_ramp - 1)] - middle
            # Fingers that open press the other way until the target has passed them: they are not done.
            pressing = torch.where(way == 0, ahead.abs(), ahead * way.sign()) > lag
            arrived = (middle - goal).abs() < 1e-3
            quiet = torch.where(still & (pressing | arrived), quiet + every, 0)
            if bool((quiet >= self.n_steps(STILL_S)).all()):
                break
        self.set_fingers(goal)
        return True
