"""One grasp attempt from pre-grasp to hold, in every sub-scene at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from array_api_compat import array_namespace
from mani_skill.utils.structs.actor import Actor
from torch import Tensor

from mskgrasp.core.geometry import Array, Pose
from mskgrasp.core.grasp import (
    MAX_OPENING,
    MIN_GAP,
    MIN_RISE,
    lowest_grasp_z,
    object_displacement,
    pose_base_grasp,
    pose_base_tcp,
)
from mskgrasp.core.minimum_jerk import minimum_jerk, minimum_jerk_duration
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import TABLE_Z, Physics
from tasks.attempt.clearance import Clearance, hand_clearance
from tasks.attempt.outcome import CODE, MAX_DRIFT, MAX_TURN, MIN_PAD_FORCE, Observed, judge
from tasks.attempt.speed_watch import SpeedWatch
from tasks.robot.contacts import HandContacts
from tasks.robot.motion import PEAK_ACCELERATION, PandaMotion, finger_lag, run_up
from tasks.robot.panda import GraspPanda
from tasks.robot.reflex import Reflex
from tasks.scene.frames import own_pose

SPEED_WINDOW_S = 0.02
"""The last part of the hold, over which the part's speed in the hand is measured, s."""
REST_TIMEOUT_S = 0.3
"""Time a part that was not lifted has to fall, roll and come to rest before it is judged, s."""
REST_WINDOW_S = 0.06
"""A part that has not moved for this time is at rest, s."""
AHEAD = 0.001
"""Least distance from the part, m, at which fingers in free air begin to close: more than a settling part
may move and still count as at rest."""
TAKE_OFF = 0.006
"""First part of the lift, m, simulated as finely as the closing: a part turns in the hand while it leaves the
table."""
LOOK_S = 0.05
"""Time between two checks of a rising part: is it still in the hand, how deep do the pads overlap it, s. Ten
times as many cost a tenth of a label and discard one attempt of 300 more, a failed one."""
ARRIVAL_S = 0.024
"""Time a hand has to come to rest after its descent, s."""
LOST_MARGIN = 0.02
"""A part is lost where it is lower in the hand than a success allows by more than this, m."""
PARKED = (0.45, 0.0, 0.35, 0.0)
"""Pose of a hand whose grasp cannot be executed, clear of every part: x, y, z, theta, base frame."""


class Attempt:
    """Execution of grasps, and measurement of the motion of the parts.

    Args:
        agent: The Panda of n sub-scenes.
        part: The part of each.
        hulls: For each sub-scene the corners (k, 3) of each hull of its part, obj frame, metres.
        motion: Moves arm and fingers.
        contacts: Forces on the hand and overlap with the part.
        physics: Speeds, forces and times of the attempt.
    """

    def __init__(
        self,
        agent: GraspPanda,
        part: Actor,
        hulls: list[list[np.ndarray]],
        motion: PandaMotion,
        contacts: HandContacts,
        physics: Physics,
    ):
        self._agent = agent
        self._part = part
        self._corners = [np.concatenate(own) for own in hulls]
        self._spans = [_spans(own) for own in hulls]
        self._motion = motion
        self._contacts = contacts
        self._physics = physics
        self._run_up = run_up(physics)
        self._arrays = motion.arrays
        self._speed = SpeedWatch(part, motion.arrays)
        motion.watch = self._speed.update

    def run(self, commanded: Tensor, executed: Tensor | None = None) -> dict[str, Tensor]:
        """Execute one grasp in every sub-scene; all of them wait for the slowest.

        Args:
            commanded: (n, 4) x, y, z, theta, base frame.
            executed: (n, 4) true target of the hand; as commanded by default.

        Returns:
            executable (n) bool, whether the pads stay off the table and the arm reaches the grasp, its
            descent and its lift: if not, nothing was tried, and only pose_base_obj means anything; success
            (n) bool; failure (n) uint8; settled (n) bool, whether the part was at rest before anything
            touched it: if not, the other values mean nothing; displacement (n, 4) and tilt (n), NaN
            where not successful; width_after (n) m; relative_speed (n), of the part in the hand when it is
            judged, m/s; pose_base_obj, pose_tcp_obj_before, pose_tcp_obj_after (n, 7); penetration (n) m, NaN
            where unknown; fastest (n), greatest speed of the part, m/s; seconds (n) of simulated time.
        """
        target = self._arrays.of(commanded)
        outcome = self._run(target, target if executed is None else self._arrays.of(executed))
        return {name: torch.as_tensor(values) for name, values in outcome.items()}

    def _run(self, commanded: Array, grasp: Array) -> dict[str, Array]:
        physics, motion, xp = self._physics, self._motion, self._arrays.xp
        start, free, reach = self._approach(grasp)
        lifted = _raised(grasp, physics.lift_height)
        executable = can_execute(xp.stack([grasp, start, lifted])).all(0)
        if not bool(executable.all()):
            # For the others a parked hand counts as one whose pads have nothing between them.
            parked = xp.broadcast_to(self._arrays.of(np.array(PARKED, np.float32)), grasp.shape)
            grasp, start, lifted = (
                xp.where(executable[:, None], one, parked) for one in (grasp, start, lifted)
            )
            free, reach = free | ~executable, xp.where(executable, reach, xp.zeros_like(reach))
        began = motion.seconds
        motion.hold(False)
        empty = free & (reach == 0)
        # Where their run-up has room, fingers begin near the part instead of closing through free air.
        room = max(self._run_up, AHEAD + physics.finger_speed / motion.rate_hz)
        running = free & ~empty & (reach + room <= MAX_OPENING / 2)
        width = xp.where(running, 2 * self._finger_start(reach), xp.full_like(reach, MAX_OPENING))
        down = None if bool(free.all()) else self._line(start, grasp, physics.descend_speed)
        motion.place(top_down(_double(grasp))[0] if down is None else down[0], width)
        self._speed.start(motion.seconds)
        placed = self._part_pose()
        # At the fine rate: a part sinks some micrometres into the table, depending on the step.
        motion.step(motion.n_steps(physics.settle_s))
        rest = self._part_pose()
        settled = at_rest(placed, rest)
        collided, touched, touching = (xp.zeros_like(settled) for _ in range(3))
        reflex = Reflex(self._contacts, motion)
        ended = bool((~settled | free).all())

        def met(_: int) -> bool:
            nonlocal ended
            force = reflex.force()
            touching[:] = force > 0
            if reflex.near:
                collided[:] = collided | (force > physics.reflex_force)
                touched[:] = touched | touching
                ended = bool((collided | ~settled | free).all())
            return ended

        if down is not None:
            if motion.follow(down, check=met, check_every=1, frozen=collided):
                for step in range(motion.n_steps(ARRIVAL_S)):
                    motion.step()
                    met(step)
            # A hand in contact yields: it must not be moved to its target.
            motion.arrive(frozen=collided | ~settled | touching)
        # A part that moved although nothing touched it was still toppling.
        settled = settled & (touched | at_rest(rest, self._part_pose()))
        held, penetration = xp.zeros_like(settled), xp.zeros_like(reach)
        alive = settled & ~collided & ~empty
        if bool(alive.any()):
            apart = collided | empty

            def all_closed() -> bool:
                return bool((apart | (motion.gap() <= MIN_GAP)).all())

            motion.run_fingers(running & ~apart)
            # Ends once the pads press with the settings' force; a drawn one that is greater is reached in the
            # first steps of the lift.
            motion.move_fingers(-MAX_OPENING / 2, frozen=apart, check=all_closed)
            held, penetration = self.grip()
        # Parts that nothing holds come to rest before the others are lifted: when they are judged must not
        # depend on other sub-scenes.
        self._wait_for_rest(alive & ~held)
        missed = self._part_pose()
        lifting = alive & held
        if bool(lifting.any()):
            penetration = xp.maximum(penetration, self._lift(grasp, lifted, lifting))
        seen = self._observe(lifting, penetration)
        self._wait_for_rest(lifting & ~seen.pads_touch)
        now = _where(lifting & seen.pads_touch, seen.part, _where(lifting, self._part_pose(), missed))
        outcome = self._outcome(commanded, rest, now, settled, collided, held, seen, began)
        outcome["failure"][~executable] = CODE["unreachable"]
        return dict(outcome, executable=executable)

    def _part_pose(self) -> Pose:
        return own_pose(self._part, self._arrays)

    def _hand_pose(self) -> Pose:
        return own_pose(self._agent.tcp, self._arrays)

    def _approach(self, grasp: Array) -> tuple[Array, Array, Array]:
        """Start of the descent and clearance of the open hand.

        Returns:
            start: (n, 4) the grasp itself where the hand can be placed there; else above it, the pads by the
                approach clearance over the part's top.
            free: (n,) bool, the hand can be placed at the grasp.
            reach: (n,) greatest distance of the part between the pads from the middle, m; 0 without a part.
        """
        above, free, reach = [], [], []
        grasps = self._arrays.numpy(grasp)
        poses = self._arrays.numpy(self._part_pose().as_vector())
        for i, (corners, spans) in enumerate(zip(self._corners, self._spans, strict=True)):
            corners = (pose_base_grasp(grasps[i]).inverse() @ Pose.from_vector(poses[i])).apply(corners)
            clearance = Clearance(free=False, reach=0.0)
            if self._physics.skip_air:
                clearance = hand_clearance([corners[span] for span in spans])
            free.append(clearance.free)
            reach.append(clearance.reach)
            top = float(corners[:, 2].max())
            clear = max(0.0, top + lowest_grasp_z(0.0) + self._physics.approach_clearance)
            above.append(0.0 if clearance.free else clear)
        own = self._arrays.of
        start = _raised(grasp, own(np.array(above, np.float32)))
        return start, own(np.array(free)), own(np.array(reach, np.float32))

    def _finger_start(self, reach: Array) -> Array:
        """(n,) distance from the middle at which fingers in free air begin to close, m.

        It is one that a ramp from the open hand reaches at the end of a step, so that the fingers meet the
        part at the same instant within a step as after the whole ramp.
        """
        step = self._physics.finger_speed / self._motion.rate_hz
        first = MAX_OPENING / 2 + finger_lag(self._physics)
        return first - self._arrays.xp.floor((first - reach - AHEAD) / step) * step

    def _wait_for_rest(self, parts: Array) -> None:
        """Wait until parts (n,) that nothing holds are at rest: the pose of a falling part is arbitrary."""
        if not bool(parts.any()):
            return
        motion = self._motion
        with motion.coarsely():
            before = self._part_pose()
            for _ in range(round(REST_TIMEOUT_S / REST_WINDOW_S)):
                motion.step(motion.n_steps(REST_WINDOW_S))
                now = self._part_pose()
                if bool((at_rest(before, now) | ~parts).all()):
                    return
                before = now

    def _lift(self, grasp: Array, lifted: Array, lifting: Array) -> Array:
        """Lift and hold; end early where no part is left in its hand.

        Args:
            grasp: (n, 4) x, y, z, theta at which the fingers closed, base frame.
            lifted: (n, 4) the same, at the end of the lift.
            lifting: (n,) bool, hands that hold a part; the others stay where they are.

        Returns:
            (n,) the deepest overlap seen, m.
        """
        motion, physics, xp = self._motion, self._physics, self._arrays.xp
        motion.hold(True)

        def behind() -> Array:
            return self._hand_pose().position[:, 2] - self._part_pose().position[:, 2]

        most_behind = behind() + (1 - MIN_RISE) * physics.lift_height + LOST_MARGIN
        deepest = self._arrays.full(motion.n, 0.0)

        def all_lost(_: int) -> bool:
            nonlocal deepest
            deepest = xp.maximum(deepest, self._contacts.penetration())
            lost = ~lifting | (motion.gap() <= MIN_GAP) | (behind() > most_behind)
            return bool(lost.all())

        def rise(times: np.ndarray) -> bool:
            up = self._line_at(grasp, lifted, times)
            return motion.follow(up, check=all_lost, check_every=motion.n_steps(LOOK_S), frozen=~lifting)

        seconds = minimum_jerk_duration(physics.lift_height, physics.lift_speed, PEAK_ACCELERATION)
        times = _moments(motion.n_steps(seconds))
        times = times[: 1 + int(np.searchsorted(physics.lift_height * minimum_jerk(times), TAKE_OFF))]
        if not rise(times):
            return deepest
        # Off the table coarse steps suffice, but not for the last measurement: with them a part trembles more
        # between the pads.
        with motion.coarsely():
            rest = 1 - times[-1]
            if rest > 0 and not rise(times[-1] + rest * _moments(motion.n_steps(rest * seconds))):
                return deepest
            motion.step(motion.n_steps(physics.hold_s - SPEED_WINDOW_S))
        return deepest

    def _observe(self, lifting: Array, penetration: Array) -> _InHand:
        """Measure the parts in the hands, in the last part of the hold."""
        xp = self._arrays.xp
        if bool(lifting.any()):
            speed = self.relative_speed()
        else:
            speed = xp.full_like(penetration, math.nan)
        touch, deepest = self.grip()
        return _InHand(
            speed=speed,
            part=self._part_pose(),
            tcp=self._hand_pose(),
            gap=self._motion.gap(),
            pads_touch=touch,
            penetration=xp.maximum(penetration, deepest),
        )

    def _outcome(
        self,
        commanded: Array,
        rest: Pose,
        now: Pose,
        settled: Array,
        collided: Array,
        held: Array,
        seen: _InHand,
        began: float,
    ) -> dict[str, Array]:
        xp = self._arrays.xp
        moved = now.position - rest.position
        success, failure = judge(
            Observed(
                settled=settled,
                collided=collided,
                held_closed=held,
                pads_touch=seen.pads_touch,
                gap=seen.gap,
                rise=moved[:, 2] / self._physics.lift_height,
                relative_speed=seen.speed,
                penetration=seen.penetration,
                wandered=_length(moved[:, :2]),
            )
        )
        before, after = pose_base_tcp(commanded).inverse() @ rest, seen.tcp.inverse() @ now
        displacement, tilt = object_displacement(before, after)
        return dict(
            success=success,
            failure=failure,
            settled=settled,
            displacement=xp.where(success[:, None], displacement, xp.full_like(displacement, math.nan)),
            tilt=xp.where(success, tilt, xp.full_like(tilt, math.nan)),
            width_after=seen.gap,
            relative_speed=seen.speed,
            pose_base_obj=rest.as_vector(),
            pose_tcp_obj_before=before.as_vector(),
            pose_tcp_obj_after=after.as_vector(),
            penetration=seen.penetration,
            fastest=self._speed.fastest(),
            seconds=xp.full_like(seen.penetration, self._motion.seconds - began),
        )

    def grip(self) -> tuple[Array, Array]:
        """(n,) whether both pads hold something, and (n,) the deepest overlap of finger and part, m."""
        force, penetration = self._contacts.pads_on_part()
        return (force > MIN_PAD_FORCE).all(-1) & (self._motion.gap() > MIN_GAP), penetration

    def relative_speed(self) -> Array:
        """(n,) speed of the part's origin in the hand over the next 20 ms, which it simulates, m/s.

        From positions: after a TGS step PhysX's velocities still hold impulses that a contact undoes.
        """
        start = self._part_in_hand()
        n_steps = self._motion.n_steps(SPEED_WINDOW_S)
        self._motion.step(n_steps)
        end = self._part_in_hand()
        return _length(end - start) * self._motion.rate_hz / n_steps

    def _part_in_hand(self) -> Array:
        return self._hand_pose().inverse().apply(self._part_pose().position)

    def _line(self, start: Array, goal: Array, speed: float) -> Array:
        """(steps, n, 7) joints along straight lines between grasps; as long as the longest line needs."""
        start, goal = self._arrays.of(start), self._arrays.of(goal)
        distance = float(_length((goal - start)[:, :3]).max())
        n_steps = self._motion.n_steps(minimum_jerk_duration(distance, speed, PEAK_ACCELERATION))
        return self._line_at(start, goal, _moments(n_steps))

    def _line_at(self, start: Array, goal: Array, times: np.ndarray) -> Array:
        """(steps, n, 7) joints at times of a straight line between grasps, as shares of its duration."""
        share = self._arrays.of(minimum_jerk(times))[:, None, None]
        start, goal = _double(start), _double(goal)
        return top_down(start + share * (goal - start))[0]


@dataclass(frozen=True, kw_only=True)
class _InHand:
    """Measurements of n hands at the end of the hold.

    Attributes:
        speed: (n,) of the part against the hand, m/s; NaN where nothing was lifted in any sub-scene.
        part: ``T_base_obj``.
        tcp: ``T_base_tcp``.
        gap: (n,) distance of the pads, m.
        pads_touch: (n,) whether both pads hold the part.
        penetration: (n,) deepest overlap of finger and part in the attempt, m.
    """

    speed: Array
    part: Pose
    tcp: Pose
    gap: Array
    pads_touch: Array
    penetration: Array


def _where(rows: Array, first: Pose, second: Pose) -> Pose:
    """The first poses in some rows (n,), the second ones in the others."""
    xp = array_namespace(rows)
    chosen = [
        xp.where(rows[:, None], a, b)
        for a, b in ((first.position, second.position), (first.quat_wxyz, second.quat_wxyz))
    ]
    return Pose(position=chosen[0], quat_wxyz=chosen[1])


def at_rest(before: Pose, after: Pose) -> Array:
    """(n,) whether the parts neither moved nor turned between two poses, beyond the bounds of rest."""
    cosine = abs((before.quat_wxyz * after.quat_wxyz).sum(-1))
    moved = _length(after.position - before.position)
    return (moved < MAX_DRIFT) & (cosine > math.cos(MAX_TURN / 2))


def can_execute(grasp: Array) -> Array:
    """(...) whether grasps (..., 4) keep the pads off the table and are within the arm's reach."""
    clear = grasp[..., 2] >= lowest_grasp_z(TABLE_Z) - 1e-6  # float32 rounds the bound itself
    return clear & top_down(_double(grasp))[1]


def _spans(hulls: list[np.ndarray]) -> list[slice]:
    """The rows of each hull among the corners of all."""
    ends = np.cumsum([len(hull) for hull in hulls]).tolist()
    return [slice(start, end) for start, end in pairwise([0, *ends])]


def _moments(n_steps: int) -> np.ndarray:
    """(n_steps,) ends of equal steps, as shares of their time."""
    return np.arange(1, n_steps + 1) / n_steps


def _raised(grasp: Array, by: Array | float) -> Array:
    raised = array_namespace(grasp).asarray(grasp, copy=True)
    raised[:, 2] += by
    return raised


def _length(vectors: Array) -> Array:
    return (vectors * vectors).sum(-1) ** 0.5


def _double(values: Array) -> Array:
    xp = array_namespace(values)
    return xp.astype(values, xp.float64)
