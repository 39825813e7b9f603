"""Parts with tape squares in the simulated cell, placed at known poses."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from mani_skill.utils.structs.pose import Pose as ManiSkillPose

from hal import Cell, RgbdFrame, SensorNoise
from hal.sensor_noise import add_noise
from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.world import SapienWorld
from mskgrasp.core.errors import TapeDoesNotFit
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, wrap_angle
from mskgrasp.core.grasp import Grasp, object_displacement
from mskgrasp.core.settings import Tape
from mskgrasp.perception.markers import Markers, find_markers, planar_displacement
from tasks.scene.frames import to_world

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
    grasp: Grasp

    @property
    def true(self) -> np.ndarray:
        """(3,) dx, dy, dtheta by the definition: poses of the part in the hand."""
        T_tcp_base = self.grasp.T_base_tcp.inverse()
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


def place_part(cell: Cell, resting: Pose, x: float, y: float, turn: float) -> Pose:
    """Places the part in its resting pose, turned, at a point."""
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
        poses.append(place_part(cell, resting, *place))
        frames.append(cell.camera.capture())
    grasp = np.array([*(start[:2] + rng.normal(0, 0.01, 2)), 0.0115, rng.uniform(-np.pi / 2, np.pi / 2)])
    return Motion(poses=(poses[0], poses[1]), frames=(frames[0], frames[1]), grasp=Grasp.from_vector(grasp))


def small_motion(cell: Cell, resting: Pose) -> Motion:
    """Half a centimetre and six degrees in the middle of the region."""
    poses, frames = [], []
    for place in ((0.5, 0.0, 0.3), (0.505, 0.004, 0.4)):
        poses.append(place_part(cell, resting, *place))
        frames.append(cell.camera.capture())
    grasp = np.array([0.5, 0.0, 0.0115, 0.2])
    return Motion(poses=(poses[0], poses[1]), frames=(frames[0], frames[1]), grasp=Grasp.from_vector(grasp))


def noisy(frame: RgbdFrame, rng: np.random.Generator) -> RgbdFrame:
    """The frame as a Kinect v2 and a colour camera would take it."""
    assert frame.fine_colour is not None
    colour = frame.fine_colour + rng.normal(0, GREY_NOISE, frame.fine_colour.shape)
    return dataclasses.replace(
        frame,
        depth=add_noise(frame.depth, frame.intrinsics, SensorNoise(model="kinect2"), rng),
        fine_colour=np.clip(np.rint(colour), 0, 255).astype(np.uint8),
    )


def blot(
    frame: RgbdFrame, pixel: np.ndarray, size: tuple[float, float], grey: int, *, round_: bool
) -> RgbdFrame:
    """Something over a place of the depth image, its size (of a disc: its radius) in pixels of colour."""
    assert frame.fine_colour is not None
    shape, place = np.zeros(frame.fine_colour.shape[:2], np.float32), (pixel + 0.5) * 3 - 0.5
    if round_:
        cv2.circle(shape, np.rint(place).astype(int).tolist(), round(size[0]), 1.0, -1, cv2.LINE_AA)
    else:
        corners = cv2.boxPoints((place.tolist(), size, 25.0))
        cv2.fillConvexPoly(shape, np.rint(corners * 16).astype(np.int32), 1.0, cv2.LINE_AA, 4)
    share = cv2.GaussianBlur(shape, (0, 0), 0.7)[..., None]
    colour = np.rint(frame.fine_colour * (1 - share) + grey * share).astype(np.uint8)
    return dataclasses.replace(frame, fine_colour=colour)


def littered(cell: Cell, frame: RgbdFrame, n: int, rng: np.random.Generator) -> Iterator[RgbdFrame]:
    """The frame with one thing of any size, shape and brightness on or beside one of its squares, n times."""
    squares = find(cell, frame).pixels
    for _ in range(n):
        place = squares[rng.integers(2)] + rng.uniform(-14 / 3, 14 / 3, 2)
        round_ = bool(rng.integers(2))
        size = rng.uniform(3, 20, 2) / (2 if round_ else 1)
        grey = int(rng.choice([20, 139, 195, 228, 255]))
        yield blot(frame, place, (size[0], size[1]), grey, round_=round_)


def find(cell: Cell, frame: RgbdFrame) -> Markers:
    return find_markers(frame, TAPE, table_z=cell.workspace.table_z, region=cell.workspace.region)


def errors(cell: Cell, motion: Motion, frames: tuple[RgbdFrame, ...] | None = None) -> tuple[float, float]:
    """Distance and angle between what is measured and what is true: millimetres, degrees."""
    before, after = (find(cell, frame) for frame in frames or motion.frames)
    measured = planar_displacement(before, after, motion.grasp, motion.poses[0].position)
    off = measured - motion.true
    return 1e3 * float(np.hypot(*off[:2])), abs(float(np.degrees(wrap_angle(off[2]))))
