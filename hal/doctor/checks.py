"""Checks of a cell, one function each; every finding names the remedy."""

from __future__ import annotations

import importlib.metadata
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hal.arm import JOINT_TOLERANCE, Arm
from hal.backends import Group, package_of
from hal.camera_calibration import Calibration, calibration_path, read_calibration
from hal.cell import Workspace
from hal.devices import out_of_reach
from hal.errors import HalError
from mskgrasp.core.errors import BadConfig, MskgraspError
from mskgrasp.core.geometry import Pose

Level = Literal["ok", "warn", "fail"]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Result of one check.

    Attributes:
        level: Severity: "ok", "warn" or "fail".
        subject: Subject of the check.
        text: Finding and, unless ok, the remedy.
    """

    level: Level
    subject: str
    text: str


_PACKAGES = {
    "franky": ("franky-control", "run: EXTRAS=dev,franka .ci/setup"),
    "panda_py": ("panda-python", "run: EXTRAS=dev,franka .ci/setup"),
    "kinect2": ("pylibfreenect2", "docs/kinect2.md says how to build it and libfreenect2"),
    "sapien": ("sapien", "run: .ci/setup"),
    "mujoco": ("mujoco", "run: EXTRAS=dev,mujoco .ci/setup"),
}
"""Packages of the drivers, and how to install them."""
_SECTIONS: tuple[tuple[str, Group], ...] = (("arm", "arms"), ("camera", "cameras"))
_LOW_DISK = 2e9
_RMS_OK = (0.005, np.radians(3.0))  # of single pictures: a flat board seen alone turns by a degree or two
_ENOUGH_POSES = 12
_STEP = 0.03
"""Step by which each joint is moved, radians."""


# ---------------------------------------------------------------------- without any device


def check_drivers(values: dict[str, Any]) -> Iterator[Finding]:
    """Whether the packages that the cell file names are installed, and which versions."""
    kind = str(values.get("type"))
    drivers: dict[str, dict[str, Any]] = {kind: {}}
    packages = {kind: package_of(kind, "cells")}
    for section, group in _SECTIONS:
        part = values.get(section)
        if isinstance(part, dict) and "driver" in part:
            name = str(part["driver"])
            drivers.setdefault(name, part)
            packages.setdefault(name, package_of(name, group))
    for name, settings in drivers.items():
        if name not in _PACKAGES:
            if packages[name] is not None:  # a recording needs no package
                yield Finding(level="ok", subject=f"driver {name}", text=f"package {packages[name]}")
            continue
        package, install = _PACKAGES[name]
        subject = f"driver {name}"
        try:
            version = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            yield Finding(level="fail", subject=subject, text=f"{package} is not installed; {install}")
            continue
        yield _driver_fits(name, package, version, settings)


def _driver_fits(name: str, package: str, version: str, settings: dict[str, Any]) -> Finding:
    robot = settings.get("robot", "panda")
    if name == "panda_py" and robot == "fr3":
        return Finding(
            level="warn",
            subject="driver panda_py",
            text=f"{package} {version} from PyPI speaks to a Panda only; for an FR3 set arm.driver to franky",
        )
    if name == "franky" and robot == "panda":
        return Finding(
            level="warn",
            subject="driver franky",
            text=f"{package} {version}: the wheel from PyPI speaks to an FR3 only; for a Panda install "
            "franky's wheel for server version 5, or set arm.driver to panda_py",
        )
    return Finding(level="ok", subject=f"driver {name}", text=f"{package} {version}")


def check_disk(folder: Path) -> Finding:
    """Whether the disk has room for datasets and recordings."""
    free = shutil.disk_usage(folder).free
    if free < _LOW_DISK:
        return Finding(
            level="warn", subject="disk", text=f"{free / 1e9:.1f} GB free; make room for recordings"
        )
    return Finding(level="ok", subject="disk", text=f"{free / 1e9:.0f} GB free")


def check_renderer() -> Finding:
    """Whether the simulated camera can render."""
    from tasks.scene.renderer import NoRenderer, render_backend

    try:
        return Finding(level="ok", subject="Vulkan", text=f"renders on {render_backend()}")
    except NoRenderer as error:
        return Finding(level="fail", subject="Vulkan", text=str(error))


def check_calibration(values: dict[str, Any], cell_file: Path, workspace: Workspace) -> Finding | None:
    """Whether the calibration file exists, is accurate and plausible; None if the camera needs none."""
    camera = values.get("camera")
    stated = camera.get("calibration") if isinstance(camera, dict) else None
    if not isinstance(camera, dict) or not isinstance(stated, str):
        return None
    path = calibration_path(stated, cell_file)
    try:
        calibration = read_calibration(path, serial=camera.get("serial"))
    except BadConfig as error:
        return Finding(level="fail", subject="calibration", text=str(error))
    return judge_calibration(calibration, path, workspace)


def judge_calibration(calibration: Calibration, path: Path, workspace: Workspace) -> Finding:
    """Whether a calibration is plausible."""
    problem = implausible(calibration.T_base_camera, workspace)
    if problem:
        return Finding(
            level="fail",
            subject="calibration",
            text=f"{path}: {problem}; calibrate again (python -m hal.calibrate)",
        )
    millimetres = calibration.rms_translation_m * 1e3
    degrees = np.degrees(calibration.rms_rotation_rad)
    said = (
        f"{path}, camera {calibration.serial}, {calibration.n_poses} poses, residuals {millimetres:.2f} mm "
        f"and {degrees:.2f} degrees, made {calibration.made}"
    )
    if calibration.by_hand:
        return Finding(
            level="warn",
            subject="calibration",
            text=f"{path} was measured by hand, good to centimetres, and no grasp is executed with it: run "
            "python -m hal.calibrate",
        )
    if calibration.rms_translation_m > _RMS_OK[0] or calibration.rms_rotation_rad > _RMS_OK[1]:
        return Finding(level="warn", subject="calibration", text=f"{said}: large residuals; calibrate again")
    if calibration.n_poses < _ENOUGH_POSES:
        return Finding(
            level="warn", subject="calibration", text=f"{said}: few poses; calibrate again with --poses 24"
        )
    return Finding(level="ok", subject="calibration", text=said)


def implausible(T_base_camera: Pose, workspace: Workspace) -> str:
    """Reason why a camera pose is implausible; empty if it is plausible."""
    x, y, z = np.asarray(T_base_camera.position, dtype=np.float64)
    height = z - workspace.table_z
    if not 0.3 <= height <= 3.0:
        return f"the camera would be {height:.2f} m over the table, not 0.3 .. 3 m"
    axis = T_base_camera.as_matrix()[:3, 2]
    if axis[2] > -0.5:
        return "the camera would not look down (its z axis, seen from the base, must point to the table)"
    seen = np.array([x, y]) + axis[:2] / -axis[2] * height
    x_min, x_max, y_min, y_max = workspace.region
    if not (x_min - 0.3 <= seen[0] <= x_max + 0.3 and y_min - 0.3 <= seen[1] <= y_max + 0.3):
        return f"the camera would look at x {seen[0]:.2f} m, y {seen[1]:.2f} m, beside the region"
    return ""


# ---------------------------------------------------------------------- arm


def check_arm(arm: Arm, connect_s: float) -> Iterator[Finding]:
    """Whether the connected arm answers, and its state."""
    before = time.monotonic()
    state = arm.state()
    took = time.monotonic() - before
    yield Finding(
        level="ok",
        subject="arm",
        text=f"connected in {connect_s:.1f} s, state in {took * 1e3:.0f} ms, TCP at "
        f"{np.round(state.T_base_tcp.position, 3).tolist()} m, pads {state.gripper_width * 1e3:.1f} mm "
        f"apart, joints {np.round(state.joints, 4).tolist()} rad",
    )
    outside = np.flatnonzero(
        (state.joints < arm.limits.joint_lower) | (state.joints > arm.limits.joint_upper)
    )
    if len(outside):
        i = int(outside[0])
        yield Finding(
            level="fail",
            subject="arm joints",
            text=f"joint {i + 1} is at {state.joints[i]:.3f} rad, outside {arm.limits.joint_lower[i]:.3f} .. "
            f"{arm.limits.joint_upper[i]:.3f}; guide the arm by hand towards the middle",
        )


def check_reach(arm: Arm, workspace: Workspace) -> Finding:
    """Whether corners, edges and middle of the region can be grasped, lifted and approached."""
    if (reason := out_of_reach(arm, workspace)) is not None:
        return Finding(level="fail", subject="workspace", text=f"{reason}; make workspace.region smaller")
    return Finding(
        level="ok", subject="workspace", text=f"region {list(workspace.region)} m: all of it within reach"
    )


def check_motion(arm: Arm) -> Iterator[Finding]:
    """Move every joint by a small step and back, and the fingers, and report the errors.

    Nothing moves while the hand holds something.
    """
    if arm.in_hand() is not None:
        yield Finding(
            level="fail",
            subject="motion",
            text="the hand holds something, which would fall: hold it, run python -m hal.home",
        )
        return
    start = arm.state().joints
    try:
        target = start + _STEP
        over = target > arm.limits.joint_upper
        target[over] = start[over] - _STEP
        arm.move_to_joints(target, speed=0.1)
        there = np.abs(arm.state().joints - target).max()
        arm.move_to_joints(start, speed=0.1)
        back = np.abs(arm.state().joints - start).max()
        worst = max(there, back)
        yield Finding(
            level="ok" if worst < JOINT_TOLERANCE / 2 else "warn",
            subject="joint motion",
            text=f"all joints by {_STEP} rad and back: within {worst * 1e3:.2f} mrad"
            + (
                ""
                if worst < JOINT_TOLERANCE / 2
                else "; see what loads the arm, and Desk's end effector mass"
            ),
        )
    except HalError as error:
        yield Finding(level="fail", subject="joint motion", text=str(error))
        return
    try:
        half = arm.state().max_width / 2
        arm.move_gripper(half)
        worst = abs(arm.state().gripper_width - half)
        arm.open_gripper()  # some hands open a little farther than a command may ask for
        state = arm.state()
        worst = max(worst, abs(state.gripper_width - state.max_width))
        yield Finding(
            level="ok",
            subject="gripper",
            text=f"{half * 1e3:.1f} and {state.max_width * 1e3:.1f} mm: within {worst * 1e3:.2f} mm",
        )
    except HalError as error:
        yield Finding(level="fail", subject="gripper", text=str(error))


def attempt(subject: str, action: Any) -> Finding | None:
    """Run an action; return its failure as a finding."""
    try:
        action()
    except MskgraspError as error:
        return Finding(level="fail", subject=subject, text=str(error))
    return None
