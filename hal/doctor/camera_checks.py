"""Checks of a cell's camera: stream, view of the region, the arm in its sight, and the table."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from hal.arm import Arm
from hal.camera import Camera, RgbdFrame
from hal.cell import Workspace
from hal.charuco import project
from hal.doctor.checks import Finding, Level, implausible
from hal.errors import HalError
from hal.execute import AT_HOME
from hal.sight import link_in_sight
from hal.table import HIGHEST_TABLE, fit_table

_MAX_AGE_S = 0.5
_GOOD_RATE = 5.0
_GOOD_VALID = 0.9
_LEAST_VALID = 0.5
_TABLE_OK = 0.0025
_TILT_OK = np.radians(0.5)
_N_FRAMES = 10


def check_stream(camera: Camera, frames: list[RgbdFrame]) -> Iterator[Finding]:
    """Take frames, append them to ``frames``, and report their rate, age and completeness."""
    ages = []
    try:
        camera.capture()  # the first may take its time
        begin = time.monotonic()
        for _ in range(_N_FRAMES):
            frame = camera.capture()
            ages.append(time.monotonic() - frame.timestamp_s)
            frames.append(frame)
    except HalError as error:
        yield Finding(level="fail", subject="camera stream", text=str(error))
        return
    n = camera.exposures
    rate = n * _N_FRAMES / (time.monotonic() - begin)
    stamps = np.array([frame.timestamp_s for frame in frames])
    height, width = frames[0].depth.shape
    said = f"{width} x {height} pixels, {rate:.1f} frames/s, {max(ages) * 1e3:.0f} ms old at most"
    if n > 1:
        said = f"{said} (each the median of {n} exposures)"
    age_s = max(ages) - (n - 1) / rate  # since the last exposure of a frame
    if (np.diff(stamps) <= 0).any():
        yield Finding(
            level="fail", subject="camera stream", text=f"{said}: the same exposure twice; open it again"
        )
    elif rate < _GOOD_RATE or age_s > _MAX_AGE_S:
        yield Finding(
            level="warn",
            subject="camera stream",
            text=f"{said}: slow; plug a real camera into a USB 3 port of its own",
        )
    else:
        yield Finding(level="ok", subject="camera stream", text=said)


def check_view(frame: RgbdFrame, workspace: Workspace) -> Iterator[Finding]:
    """Whether the camera sees the whole region, from the table up to the height of a lift."""
    problem = implausible(frame.T_base_camera, workspace)
    if problem:
        yield Finding(
            level="fail", subject="camera pose", text=f"{problem}; calibrate with python -m hal.calibrate"
        )
        return
    x_min, x_max, y_min, y_max = workspace.region
    heights = (workspace.table_z, workspace.table_z + workspace.lift_height)
    corners = np.array([[x, y, z] for x in (x_min, x_max) for y in (y_min, y_max) for z in heights])
    pixels = project(frame.T_base_camera.inverse().apply(corners), frame.intrinsics)
    limit = np.array(frame.depth.shape[::-1]) - 1
    inside = ((pixels >= 0) & (pixels <= limit)).all()
    margin = float(np.minimum(pixels, limit - pixels).min())
    yield Finding(
        level="ok" if inside else "fail",
        subject="camera view",
        text=f"region whole in the image, {margin:.0f} pixels from its edge"
        if inside
        else f"the region, up to the {workspace.lift_height * 1e3:.0f} mm of a lift, reaches {-margin:.0f} "
        "pixels out of the image; move the camera, or make workspace.region smaller",
    )


def check_sight(frame: RgbdFrame, arm: Arm, workspace: Workspace) -> Iterator[Finding]:
    """Whether the arm is in the camera's sight of the region: it would be taken for the table, or a part."""
    if arm.links is None:
        return
    try:
        joints = arm.state().joints
    except HalError:
        return  # reported with the arm
    if name := link_in_sight(arm.links, joints, frame, workspace):
        at_home = np.abs(joints - workspace.home).max() <= AT_HOME
        yield Finding(
            level="fail",
            subject="camera view",
            text=f"the arm's {name} is in the camera's sight of the region: "
            + ("choose other joints for workspace.home" if at_home else "move the arm home first"),
        )


def check_table(frame: RgbdFrame, workspace: Workspace) -> Iterator[Finding]:
    """Whether the table in the depth image is at the height that the cell file states."""
    plane = fit_table(frame.depth, frame.intrinsics, frame.T_base_camera, workspace.region, workspace.table_z)
    if plane is None:
        yield Finding(
            level="fail",
            subject="depth",
            text="no table over the region; uncover it, avoid glossy or black surfaces and sunlight",
        )
        return
    said = f"{plane.valid:.0%} of the region has a depth, {plane.share:.0%} of that is table"
    level: Level = "ok" if plane.valid >= _GOOD_VALID else "warn" if plane.valid >= _LEAST_VALID else "fail"
    remedy = "" if level == "ok" else "; avoid glossy or black surfaces and sunlight"
    yield Finding(level=level, subject="depth", text=f"{said}, noise {plane.noise * 1e3:.1f} mm{remedy}")
    off = plane.z - workspace.table_z
    tilt_rad = float(np.arctan(np.linalg.norm(np.subtract(plane.slope, workspace.table_slope))))
    tilt_deg = np.degrees(tilt_rad)
    said = f"{off * 1e3:+z.1f} mm from table_z {workspace.table_z:.4f} m, tilted by {tilt_deg:.2f} degrees"
    if tilt_rad > 2 * _TILT_OK:
        yield Finding(
            level="fail",
            subject="table",
            text=f"{said}; run hal.touch, then calibrate again (python -m hal.calibrate)",
        )
    elif abs(off) >= workspace.min_height:
        yield Finding(
            level="fail",
            subject="table",
            text=f"{said}: parts are not detected with an error this large; run hal.touch: if table_z "
            f"holds, add {off:+z.4f} to camera.depth_offset (the camera measures "
            f"{'short' if off > 0 else 'too far'})",
        )
    elif off > HIGHEST_TABLE:
        yield Finding(
            level="fail",
            subject="table",
            text=f"{said}: programs refuse a table seen more than {HIGHEST_TABLE * 1e3:g} mm higher; run "
            f"hal.touch: if table_z holds, add {off:+z.4f} to camera.depth_offset",
        )
    elif abs(off) > max(_TABLE_OK, workspace.min_height / 2) or tilt_rad > _TILT_OK:
        yield Finding(
            level="warn",
            subject="table",
            text=f"{said}; let the camera warm up, then correct camera.depth_offset",
        )
    else:
        yield Finding(level="ok", subject="table", text=said)
