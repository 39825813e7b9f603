"""One grasp attempt from pre-grasp to hold, in every sub-scene at once."""

from __future__ import annotations

import math

import numpy as np
import torch
from mani_skill.utils.structs.actor import Actor
from torch import Tensor

from mskgrasp.geometry import Pose
from mskgrasp.grasp import (
    MAX_OPENING,
    MIN_GAP,
    MIN_RISE,
    lowest_grasp_z,
    object_displacement,
    pose_base_grasp,
    pose_base_tcp,
)
from mskgrasp.settings import TABLE_Z, Physics
from tasks.clearance import Clearance, hand_clearance
from tasks.contacts import HandContacts
from tasks.frames import base_pose
from tasks.kinematics import top_down
from tasks.motion import PEAK_ACCELERATION, PandaMotion, ease, ease_duration, run_up
from tasks.outcome import MAX_DRIFT, MAX_TURN, MIN_PAD_FORCE, Observed, judge
from tasks.panda import GraspPanda
from tasks.watch import SpeedWatch

SPEED_WINDOW_S = 0.02
"""The last part of the hold, over which the part's speed in the hand is measured, s."""
AFTERMATH_S = 0.3
"""How long a part that was not lifted may fall, roll and come to rest before it is judged, s."""
REST_WINDOW_S = 0.06
"""A part that did not move for so long has come to rest, s."""
AHEAD = 0.003
"""Distance from the part, m, at which fingers begin that have only air before them: more than a part moves
that settles and yet counts as at rest."""
LEFT_BEHIND = 0.02
"""The hand this much farther from the part than a success may be has lost it, m."""


class Attempt:
    """Executes grasps and measures what they did to the parts.

    Args:
        agent: The Panda of n sub-scenes.
        part: The part of each.
        hulls: For each sub-scene the corners (k, 3) of each hull of its part, obj frame, metres.
        motion: Moves arm and fingers.
        contacts: What touches the hand.
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
        self._hull_ends = [np.cumsum([len(hull) for hull in own])[:-1] for own in hulls]
        self._motion = motion
        self._contacts = contacts
        self._physics = physics
        self._run_up = run_up(physics)
        self._speed = SpeedWatch(part, gpu=motion.gpu)
        motion.watch = self._speed.look

    def run(self, commanded: Tensor, executed: Tensor | None = None) -> dict[str, Tensor]:
        """Executes one grasp in every sub-scene; all of them wait for the slowest.

        Args:
            commanded: (n, 4) x, y, z, theta, base frame.
            executed: (n, 4) where the hand truly goes; as commanded by default.

        Returns:
            success (n) bool; failure (n) uint8; displacement (n, 4) and tilt (n), NaN where not
            successful; width_after (n) m; pose_base_obj, pose_tcp_obj_before, pose_tcp_obj_after (n, 7);
            penetration (n) m, NaN where unknown; fastest (n), greatest speed of the part, m/s; seconds (n) of
            simulated time.

        Raises:
            ValueError: A grasp is too low or out of the arm's reach.
        """
        physics, motion = self._physics, self._motion
        grasp = commanded if executed is None else executed
        start, free, reach = self._approach(grasp)
        lifted = grasp.clone()
        lifted[:, 2] += physics.lift_height
        check_grasps(torch.cat([grasp, start, lifted]))
        began = motion.seconds
        empty = free & (reach == 0)
        # Fingers that would have only air to close through, and room for their run-up, begin near the part.
        running = free & ~empty & (reach + max(self._run_up, AHEAD) <= MAX_OPENING / 2)
        width = torch.where(running, 2 * (reach + AHEAD), torch.full_like(reach, MAX_OPENING))
        down = self._line(start, grasp, physics.descend_speed)
        motion.place(down[0], width)
        self._speed.start(motion.seconds)
        laid = base_pose(self._part)
        with motion.coarsely():
            motion.step(motion.n_steps(physics.settle_s))
        rest = base_pose(self._part)
        settled = at_rest(laid, rest)
        collided, touched = torch.zeros_like(settled), torch.zeros_like(settled)

        def reflex(_: int) -> bool:
            force = self._contacts.hand_force().to(motion.device)
            collided.logical_or_(force > physics.reflex_force)
            touched.logical_or_(force > 0)
            return bool((collided | ~settled | free).all())

        if not bool(free.all()):
            motion.follow(down, check=reflex, frozen=collided)
        # A part that moved although nothing touched it was still toppling.
        settled = settled & (touched | at_rest(rest, base_pose(self._part)))
        held, penetration = torch.zeros_like(settled), torch.zeros(motion.n, device=motion.device)
        alive = settled & ~collided & ~empty
        if bool(alive.any()):
            apart = collided | empty

            def all_met() -> bool:
                return bool((apart | (self._gap() <= MIN_GAP)).all())

            motion.run_fingers(running & ~apart)
            motion.move_fingers(-MAX_OPENING / 2, frozen=apart, check=all_met)
            held, penetration = self.grip()
        # What the fingers do to the part is done: what follows needs no such fine steps. The last look does:
        # a part trembles between the pads, and more at half the rate.
        with motion.coarsely():
            carried = bool((alive & held).any())
            if carried:
                carried = self._lift(grasp, lifted, alive & held, collided, penetration)
            if not carried and bool(alive.any()):
                self._wait_for_rest()
        return self._outcome(commanded, rest, settled, collided, held, penetration, began)

    def _approach(self, grasp: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Where the descent begins (n, 4), whether it meets nothing (n,), and what stands between the pads.

        Returns:
            start: The grasp itself where the hand can be put there; else over it, pads clear of the part's
                top by the approach clearance.
            free: (n,) bool.
            reach: (n,) greatest distance from the middle of what stands between the pads, m.
        """
        start, free, reach = grasp.clone(), [], []
        pose = base_pose(self._part)
        position, quat_wxyz = pose.position.cpu().numpy(), pose.quat_wxyz.cpu().numpy()
        for i, (corners, ends) in enumerate(zip(self._corners, self._hull_ends, strict=True)):
            own = Pose(position=position[i].astype(float), quat_wxyz=quat_wxyz[i].astype(float))
            seen = pose_base_grasp(grasp[i].cpu().numpy().astype(float)).inverse() @ own
            corners = seen.apply(corners)
            clearance = Clearance(free=False, reach=0.0)
            if self._physics.skip_air:
                clearance = hand_clearance(np.split(corners, ends))
            free.append(clearance.free)
            reach.append(clearance.reach)
            if not clearance.free:
                top = float(corners[:, 2].max())
                start[i, 2] += max(0.0, top + lowest_grasp_z(0.0) + self._physics.approach_clearance)
        device = grasp.device
        return start, torch.tensor(free, device=device), torch.tensor(reach, device=device, dtype=grasp.dtype)

    def _wait_for_rest(self) -> None:
        """Lets parts that were not lifted fall and roll: in flight, a look would call them by its moment."""
        motion = self._motion
        before = base_pose(self._part)
        for _ in range(round(AFTERMATH_S / REST_WINDOW_S)):
            motion.step(motion.n_steps(REST_WINDOW_S))
            now = base_pose(self._part)
            if bool(at_rest(before, now).all()):
                return
            before = now

    def _lift(
        self, grasp: Tensor, lifted: Tensor, alive: Tensor, collided: Tensor, penetration: Tensor
    ) -> bool:
        """Lifts and holds; False where nothing was left to hold. Deepens ``penetration`` in place."""
        motion, physics = self._motion, self._physics
        hand_z = base_pose(self._agent.tcp).position[:, 2]
        part_z = base_pose(self._part).position[:, 2]

        most_behind = (1 - MIN_RISE) * physics.lift_height + LEFT_BEHIND

        def all_lost(_: int) -> bool:
            hand_rise = base_pose(self._agent.tcp).position[:, 2] - hand_z
            part_rise = base_pose(self._part).position[:, 2] - part_z
            lost = ~alive | (self._gap() <= MIN_GAP) | (hand_rise - part_rise > most_behind)
            torch.maximum(penetration, self._contacts.penetration().to(penetration), out=penetration)
            return bool(lost.all())

        up = self._line(grasp, lifted, physics.lift_speed)
        # An arm that its reflex has stopped stays where it is.
        if not motion.follow(up, check=all_lost, check_every=self._motion.n_steps(0.05), frozen=collided):
            return False
        motion.step(motion.n_steps(physics.hold_s - SPEED_WINDOW_S))
        return True

    def _outcome(
        self,
        commanded: Tensor,
        rest: Pose,
        settled: Tensor,
        collided: Tensor,
        held: Tensor,
        penetration: Tensor,
        began: float,
    ) -> dict[str, Tensor]:
        speed = self.relative_speed()
        now, tcp = base_pose(self._part), base_pose(self._agent.tcp)
        touch, deepest = self.grip()
        deepest = torch.maximum(penetration, deepest)
        moved = now.position - rest.position
        success, failure = judge(
            Observed(
                settled=settled,
                collided=collided,
                held_closed=held,
                pads_touch=touch,
                gap=self._gap(),
                rise=moved[:, 2] / self._physics.lift_height,
                relative_speed=speed,
                penetration=deepest,
                wandered=moved[:, :2].norm(dim=-1),
            )
        )
        before, after = pose_base_tcp(commanded).inverse() @ rest, tcp.inverse() @ now
        displacement, tilt = object_displacement(before, after)
        unknown = torch.full_like(displacement, math.nan)
        return dict(
            success=success,
            failure=failure,
            displacement=torch.where(success[:, None], displacement, unknown),
            tilt=torch.where(success, tilt, unknown[:, 0]),
            width_after=self._gap(),
            pose_base_obj=rest.as_vector(),
            pose_tcp_obj_before=before.as_vector(),
            pose_tcp_obj_after=after.as_vector(),
            penetration=deepest,
            fastest=self._speed.fastest(deepest),
            seconds=torch.full_like(deepest, self._motion.seconds - began),
        )

    def grip(self) -> tuple[Tensor, Tensor]:
        """(n,) whether both pads hold something, and (n,) the deepest overlap of finger and part, m."""
        force, penetration = (one.to(self._motion.device) for one in self._contacts.pads_on_part())
        return (force > MIN_PAD_FORCE).all(dim=-1) & (self._gap() > MIN_GAP), penetration

    def relative_speed(self) -> Tensor:
        """(n,) speed of the part's origin in the hand over the next 20 ms, which it simulates, m/s.

        From positions: after a TGS step PhysX's velocities still hold impulses that a contact undoes.
        """
        start = self._part_in_hand()
        n_steps = self._motion.n_steps(SPEED_WINDOW_S)
        self._motion.step(n_steps)
        end = self._part_in_hand()
        return (end - start).norm(dim=-1) * self._motion.rate_hz / n_steps

    def _part_in_hand(self) -> Tensor:
        return base_pose(self._agent.tcp).inverse().apply(base_pose(self._part).position)

    def _gap(self) -> Tensor:
        return self._agent.robot.get_qpos()[:, 7:9].sum(dim=-1)

    def _line(self, start: Tensor, goal: Tensor, speed: float) -> Tensor:
        """(steps, n, 7) joints along straight lines between grasps; as long as the longest line needs."""
        distance = float((goal - start)[:, :3].norm(dim=-1).max())
        n_steps = self._motion.n_steps(ease_duration(distance, speed, PEAK_ACCELERATION))
        share = ease(n_steps, self._motion.device)[:, None, None]
        start, goal = start.double(), goal.double()
        return top_down(start + share * (goal - start))[0]


def at_rest(before: Pose, after: Pose) -> Tensor:
    """(n,) whether the parts neither moved nor turned between two looks, beyond the bounds of rest."""
    cosine = (before.quat_wxyz * after.quat_wxyz).sum(dim=-1).abs()
    moved = (after.position - before.position).norm(dim=-1)
    return (moved < MAX_DRIFT) & (cosine > math.cos(MAX_TURN / 2))


def check_grasps(grasp: Tensor) -> None:
    """Refuses grasps that would drive the pads into the table or that the arm cannot reach.

    Raises:
        ValueError: Names the first such grasp.
    """
    lowest = lowest_grasp_z(TABLE_Z)
    if bool((grasp[:, 2] < lowest - 1e-6).any()):  # float32 rounds the bound itself
        raise ValueError(
            f"grasp z {float(grasp[:, 2].min()):.4f} m would put the pads into the table; "
            f"the lowest is {lowest:.4f} m"
        )
    reachable = top_down(grasp.double())[1]
    if not bool(reachable.all()):
        first = [round(v, 4) for v in grasp[~reachable][0].tolist()]
        raise ValueError(f"grasp {first} (x, y, z, theta) is out of the arm's reach")
