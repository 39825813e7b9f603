"""Simulated world shared by camera, arm, feeder and tracker of a cell."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import gymnasium
import numpy as np
import sapien
import torch
from mani_skill.utils.structs.actor import Actor

from hal.errors import NotConnected
from hal.sim.board import show_board
from hal.sim.colour import FineColour
from hal.sim.pallet import FALLEN, Lying, outside, restore
from hal.sim.rest import RestWatch, rigid_component
from hal.sim.tape import stick_tape
from hal.simulated import SimulatedWorld, panda_limits
from mskgrasp.core.errors import TapeDoesNotFit
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import TABLE_Z, Physics, Tape
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.hulls import hull_corners
from tasks import GraspDisplacementEnv
from tasks.attempt.clearance import hand_clearance
from tasks.scene.frames import base_pose, to_world
from tasks.scene.renderer import render_backend


@dataclass(kw_only=True, eq=False)
class SapienWorld(SimulatedWorld):
    """One sub-scene of ``GraspDisplacement-v1`` on the CPU; built when first connected.

    Attributes:
        physics: Settings of the simulation.
        tape: Squares of tape that are stuck on top of every part; None for none.
        colour_scale: Above 1, frames also hold a colour image finer than depth by this factor.
    """

    physics: Physics
    tape: Tape | None = None
    colour_scale: int = 1
    _fine_colour: FineColour | None = field(default=None, init=False)
    _beside: list[Lying] = field(default_factory=list, init=False)
    _hull_corners: dict[str, list[np.ndarray]] = field(default_factory=dict, init=False)
    _gym: gymnasium.Env | None = field(default=None, init=False)
    _rest: RestWatch = field(default_factory=RestWatch, init=False)

    @property
    def env(self) -> GraspDisplacementEnv:
        """The environment.

        Raises:
            NotConnected: No device of this cell is connected.
        """
        if self._gym is None:
            raise NotConnected("the simulated cell is closed; use it inside open_cell(...)")
        env = self._gym.unwrapped
        assert isinstance(env, GraspDisplacementEnv)
        return env

    def _build(self) -> None:
        logging.getLogger("mani_skill").setLevel(logging.ERROR)
        self._gym = gymnasium.make(
            "GraspDisplacement-v1",
            parts=[str(find_part(self.part).folder)],
            obs_mode="none",
            physics=self.physics.model_dump(),
            camera=self.overhead.model_dump(),
            region=self.region,
            sim_backend="physx_cpu",
            render_backend=render_backend(),
        )
        try:
            # Programs place their own parts: a first part without room for tape must not stop them.
            with contextlib.suppress(TapeDoesNotFit):
                self.present(self.part, self.seed)
        except BaseException:
            self._free()
            raise

    def _free(self) -> None:
        self._fine_colour = None
        self._beside = []
        if self._gym is not None:
            self._gym.close()
            self._gym = None

    def _place(self, part: Part, seed: int, keep: bool) -> None:
        staying = (
            outside(self.region, [*self._beside, Lying(self.env.parts[0], self.env.part)]) if keep else []
        )
        self._fine_colour = None
        self.env.reset(seed=seed, options=dict(parts=[str(part.folder)], reconfigure=True))
        self._move_table()
        self._watch_motions()
        self._beside = [
            restore(self.env.scene, lying, pose, number, 2 * self.physics.friction_table_part)
            for number, (lying, pose) in enumerate(staying)
        ]
        self._rest = RestWatch()
        self._rest.look(self.env.motion.seconds, self._bodies, touched=False)
        self.env.motion.place(torch.as_tensor(self.home, dtype=torch.float64)[None])
        self.env.motion.step(self.env.motion.n_steps(self.physics.settle_s))
        if self.tape is not None:
            entity = self.env.part._objs[0]
            stick_tape(entity, self.env.parts[0], self.part_pose().quat_wxyz, self.tape)

    def _watch_motions(self) -> None:
        """Have the scene's motions, which are built with it, look at the parts and call `watch`, too."""
        motion = self.env.motion
        judged = motion.watch

        def passed(seconds: float) -> None:
            if judged is not None:
                judged(seconds)
            contacts = self.env.contacts
            touched = contacts.near() and bool(np.any(contacts.load()))
            self._rest.look(seconds, self._bodies, touched=touched)
            self.call_watch()

        motion.watch = passed

    def _move_table(self) -> None:
        """Move the table, and the part with it, to where they truly are."""
        moved = self.table_motion
        if moved is None:
            return
        for body in (self.env.scene.actors["table"], self.env.part):
            pose = moved @ _pose_of(body)
            body.set_pose(sapien.Pose(to_world(pose.position), pose.quat_wxyz))

    def fine_colour(self) -> np.ndarray | None:
        """Fine colour image of the current scene; None if the settings request none."""
        if self.colour_scale == 1:
            return None
        if self._fine_colour is None:
            self._fine_colour = FineColour(self.env, self.overhead, self.colour_scale)
        return self._fine_colour.capture()

    def hold_board(self, image: np.ndarray, size: tuple[float, float], T_tcp_board: Pose) -> None:
        """Attach a flat board to the hand, visual only.

        Args:
            image: (h, w) grey levels of its printed side, uint8.
            size: Its width and height, metres.
            T_tcp_board: Origin in its middle, x right and y down as it is read, z into it.
        """
        hand = self.env.agent.tcp
        assert hand is not None
        show_board(hand._objs[0].entity, image, size, T_tcp_board)

    @contextmanager
    def parts_kept_still(self) -> Iterator[None]:
        """Keep parts that are at rest where they are, while nothing can touch them.

        A part that stands on an edge or on teeth creeps in long steps: a pinion shaft by 5 mm/s at 125 Hz.
        """
        still = [rigid_component(body) for body in self._bodies if self._rest.at_rest(body)]
        for body in still:
            body.set_locked_motion_axes([True] * 6)
        try:
            yield
        finally:
            for body in still:
                body.set_locked_motion_axes([False] * 6)
                body.set_linear_velocity([0.0, 0.0, 0.0])
                body.set_angular_velocity([0.0, 0.0, 0.0])

    def at_rest(self) -> bool:
        """Whether all parts are at rest; those that fell off the table do not count."""
        bodies = [body for body in self._bodies if _pose_of(body).position[2] > TABLE_Z - FALLEN]
        return all(map(self._rest.at_rest, bodies))

    def top_beside(self) -> float:
        """Height of the highest point of the table and of the parts beside the one presented last, m."""
        limits = panda_limits()
        low, high = limits.box_lower, limits.box_upper
        table = np.array([[x, y, TABLE_Z] for x in (low[0], high[0]) for y in (low[1], high[1])])
        if self.table_motion is not None:
            table = self.table_motion.apply(table)
        return max(float(corners[:, 2].max()) for corners in [table, *map(self._corners, self._beside)])

    def top(self) -> float:
        """Height of the highest point of the table and of all parts, m."""
        return max(self.top_beside(), float(self._corners(self._present)[:, 2].max()))

    def reach(self, T_base_tcp: Pose) -> float | None:
        """Greatest distance of the parts between the open pads from the middle between the pads, m.

        Returns:
            None where anything is in the way of the open hand, or nothing between the pads.
        """
        grasp = T_base_tcp @ Pose(position=np.zeros(3), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))
        found = hand_clearance(
            [
                (grasp.inverse() @ _pose(one)).apply(corners)
                for one in [*self._beside, self._present]
                for corners in self._hulls(one)
            ]
        )
        return found.reach if found.free and found.reach > 0 else None

    @property
    def _bodies(self) -> list[Actor]:
        return [lying.body for lying in [*self._beside, self._present]]

    @property
    def _present(self) -> Lying:
        return Lying(self.env.parts[0], self.env.part)

    def _hulls(self, lying: Lying) -> list[np.ndarray]:
        """Corners (k, 3) of each of a part's hulls, obj frame, metres."""
        if lying.part.content_hash not in self._hull_corners:
            self._hull_corners[lying.part.content_hash] = hull_corners(lying.part)
        return self._hull_corners[lying.part.content_hash]

    def _corners(self, lying: Lying) -> np.ndarray:
        """Corners (k, 3) of a part's hulls, base frame, metres."""
        return _pose(lying).apply(np.concatenate(self._hulls(lying)))

    def part_pose(self) -> Pose:
        """``T_base_obj`` of the part, the simulator's ground truth."""
        return _pose(self._present)


def _pose(lying: Lying) -> Pose:
    return _pose_of(lying.body)


def _pose_of(body: Actor) -> Pose:
    pose = base_pose(body)
    return Pose(
        position=pose.position[0].cpu().numpy().astype(np.float64),
        quat_wxyz=pose.quat_wxyz[0].cpu().numpy().astype(np.float64),
    )
