"""Frames of simulated cells with a part in a known pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.sensor_noise import SensorNoise, add_noise
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.part_detection import find_part_pixels
from mskgrasp.perception.part_pose import KnownPart, PartPose, find_part_pose
from mskgrasp.perception.part_pose.likelihood import Seen
from mskgrasp.perception.part_pose.part_pose import see

_KNOWN: dict[tuple[str, tuple[bool, ...]], KnownPart] = {}
_prepare = KnownPart.of


def prepared(part: Part, stands: Sequence[bool] | None = None) -> KnownPart:
    """What `KnownPart.of` makes, which takes seconds, made once in a process."""
    key = part.content_hash, tuple(stands or ())
    if key not in _KNOWN:
        _KNOWN[key] = _prepare(part, stands)
    return _KNOWN[key]


def known(name: str) -> KnownPart:
    """A part of the starter set, prepared once."""
    return prepared(find_part(name))


def presented(cell: Cell, name: str, seed: int) -> tuple[RgbdFrame, Pose]:
    """A frame of a part that the cell's feeder placed, and the simulator's pose."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present(name, seed)
    return cell.camera.capture(), cell.tracker.part_pose()


def resting_at(name: str, resting: int, x: float, y: float, turn: float) -> Pose:
    """``T_base_obj`` of a part in one of its resting poses."""
    poses = find_part(name).resting
    place = Pose(position=np.array([x, y, 0.0]), quat_wxyz=quat_about_z(np.array(turn)))
    return place @ Pose(position=poses.position[resting], quat_wxyz=poses.quat_wxyz[resting])


def posed(cell: Cell, name: str, T_base_obj: Pose) -> RgbdFrame:
    """A frame of a part at any pose in the MuJoCo cell, whose camera simulates no physics."""
    feeder: Any = cell.feeder
    feeder.present(name, 0)
    feeder.simulation.data.joint("part0").qpos[:] = T_base_obj.as_vector()
    return cell.camera.capture()


def kinect2(frame: RgbdFrame, seed: int) -> RgbdFrame:
    """The frame with the noise of a Kinect v2."""
    rng = np.random.default_rng(seed)
    return replace(frame, depth=add_noise(frame.depth, frame.intrinsics, SensorNoise(model="kinect2"), rng))


def seen(cell: Cell, frame: RgbdFrame, name: str) -> Seen:
    """The pixels of what is detected in a frame, as those of a part of the starter set."""
    space = cell.workspace
    found = find_part_pixels(
        frame.depth, frame.intrinsics, frame.T_base_camera,
        table_z=space.table_z, region=space.region, min_height=0.003,
    )  # fmt: skip
    return see(found, frame, known(name), space.table_z)


def heights_by_rays(convex: trimesh.Trimesh, start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Heights (n,) at which rays (n, 3) first meet a convex mesh, 0 where they pass it.

    A ray enters a convex body where it has passed the last of the planes that it meets from outside.
    """
    ahead = ((convex.triangles[:, 0] - start[:, None]) * convex.face_normals).sum(axis=-1)
    towards = along @ convex.face_normals.T
    with np.errstate(divide="ignore"):
        enters = np.where(towards < 0, ahead / towards, -np.inf).max(axis=1)
        leaves = np.where(towards > 0, ahead / towards, np.inf).min(axis=1)
    return np.where(enters < leaves, start[:, 2] + enters * along[:, 2], 0.0)


def find(cell: Cell, frame: RgbdFrame, name: str, min_height: float = 0.002) -> PartPose:
    """The pose of a part of the starter set in a frame."""
    space = cell.workspace
    return find_part_pose(
        frame, known(name), table_z=space.table_z, region=space.region, min_height=min_height
    )
