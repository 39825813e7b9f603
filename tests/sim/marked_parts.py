"""Parts with tape squares in the simulated cell, laid where they are told to lie: the truth is known."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import torch
from mani_skill.utils.structs.pose import Pose as ManiSkillPose

from hal import Cell, RgbdFrame
from hal.sim import SapienCellConfig, SensorNoise, sapien_cell
from hal.sim.noise import add_noise
from hal.sim.world import SapienWorld
from mskgrasp.errors import TapeDoesNotFit
from mskgrasp.geometry import Pose, quat_about_z, quat_multiply, wrap_angle
from mskgrasp.grasp import object_displacement, pose_base_tcp
from mskgrasp.markers import Markers, find_markers, planar_displacement
from mskgrasp.settings import Tape
from tasks.frames import to_world

TAPE = Tape()
PARTS = (
    "u_bracket_60x35",
    "parallel_key_b20x12x80",
    "parallel_key_a16x10x56",
    "pillow_block_80x32",
    "hinge_60x30",
    "washer_m36",
)
GREY_NOISE = 3.0
"""Standard deviation of a colour pixel, grey levels."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What was done to a part, and what was seen of it."""

    poses: tuple[Pose, Pose]
    frames: tuple[RgbdFrame, RgbdFrame]
    grasp: np.ndarray

    @property
    def true(self) -> np.ndarray:
        """(3,) dx, dy, dtheta by the definition: poses of the part in the hand."""
        T_tcp_base = pose_base_tcp(self.grasp).inverse()
        displacement, tilt = object_displacement(*(T_tcp_base @ pose for pose in self.poses))
        assert tilt < 1e-3
        return displacement[[0, 1, 3]]


def marked_cell(part: str = PARTS[0], *, scale: int = 3, tape: Tape | None = TAPE) -> Cell:
    return sapien_cell(SapienCellConfig(type="sapien", part=part, tape=tape, colour_scale=scale))


def world(cell: Cell) -> SapienWorld:
    assert isinstance(cell.feeder, SapienWorld)
    return cell.feeder


def present(cell: Cell, part: str) -> Pose:
    """Lays a part in the first of its random poses that has room for the tape."""
    for seed in range(30):
        try:
            world(cell).present(part, seed)
        except TapeDoesNotFit:
            continue
        return world(cell).part_pose()
    raise TapeDoesNotFit(part)


def lay(cell: Cell, resting: Pose, x: float, y: float, turn: float) -> Pose:
    """Lays the part as it rests, turned, at a place."""
    pose = Pose(
        position=np.array([x, y, resting.position[2]]),
        quat_wxyz=quat_multiply(quat_about_z(np.array(turn)), resting.quat_wxyz),
    )
    position, quat_wxyz = (
        torch.as_tensor(v, dtype=torch.float32)[None] for v in (to_world(pose.position), pose.quat_wxyz)
    )
    world(cell).env.part.set_pose(ManiSkillPose.create_from_pq(position, quat_wxyz))
    return pose


def random_motion(cell: Cell, resting: Pose, rng: np.random.Generator) -> Motion:
    """A part anywhere, moved by up to 2 cm and 30 degrees."""
    start = np.array([*rng.uniform([0.43, -0.07], [0.57, 0.07]), rng.uniform(-np.pi, np.pi)])
    end = start + rng.uniform(-1, 1, 3) * [0.02, 0.02, np.radians(30)]
    poses, frames = [], []
    for place in (start, end):
        poses.append(lay(cell, resting, *place))
        frames.append(cell.camera.capture())
    grasp = np.array([*(start[:2] + rng.normal(0, 0.01, 2)), 0.0115, rng.uniform(-np.pi / 2, np.pi / 2)])
    return Motion(poses=(poses[0], poses[1]), frames=(frames[0], frames[1]), grasp=grasp)


def noisy(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    """The frame as a Kinect v2 and a colour camera would take it."""
    assert frame.fine_colour is not None
    colour = frame.fine_colour + rng.normal(0, GREY_NOISE, frame.fine_colour.shape)
    return dataclasses.replace(
        frame,
        depth=add_noise(frame.depth, frame.intrinsics, SensorNoise(model="kinect2"), rng),
        fine_colour=np.clip(np.rint(colour), 0, 255).astype(np.uint8),
    )


def find(cell: Cell, frame: RgbdFrame) -> Markers:
    return find_markers(frame, TAPE, table_z=cell.workspace.table_z, region=cell.workspace.region)


def errors(cell: Cell, motion: Motion, frames: tuple[RgbdFrame, ...] | None = None) -> tuple[float, float]:
    """Distance and angle between what is measured and what is true: millimetres, degrees."""
    before, after = (find(cell, frame) for frame in frames or motion.frames)
    measured = planar_displacement(before, after, motion.grasp, motion.poses[0].position)
    off = measured - motion.true
    return 1e3 * float(np.hypot(*off[:2])), abs(float(np.degrees(wrap_angle(off[2]))))
