"""Cell of an arm and a camera, each chosen by its ``driver``."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, assert_never, get_args

import numpy as np

from hal.arm import Arm
from hal.backends import build, find_backend
from hal.camera import Camera
from hal.camera_calibration import calibration_path
from hal.cell import Cell, PartFeeder, Workspace
from hal.config import READY, DevicesConfig, WorkspaceConfig
from hal.errors import OutOfWorkspace
from hal.execute import APPROACH
from hal.keep_out import camera_keep_out
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.grasp import pose_base_tcp

ArmDriver = Literal["franky", "panda_py", "replay"]
CameraDriver = Literal["kinect2", "replay", "sapien"]


def devices_cell(values: dict[str, Any], path: Path) -> Cell:
    """Build the cell that a file of this type describes; nothing is connected yet.

    Raises:
        BadConfig: The file is not valid, or its sections do not fit each other.
    """
    config = check_config(DevicesConfig, values, str(path))
    table = config.workspace
    workspace = Workspace(
        table_z=table.table_z,
        region=table.region,
        home=np.array(table.home),
        min_height=table.min_height,
        lift_height=table.lift_height,
        grasp_force=table.grasp_force,
        clearance=table.clearance,
        table_slope=table.table_slope,
    )
    arm = _arm(config.arm, table, path)
    replayed = config.arm.get("driver") == "replay"
    if not replayed:  # whose fit was checked when it was recorded: it accepts the recorded poses alone
        _check_fit(arm, workspace, path)
    camera, feeder = _camera(config.camera, workspace, path)
    if arm.links is not None and camera.T_base_camera is not None:
        body = camera_keep_out(camera.T_base_camera)
        arm.limits = replace(arm.limits, keep_out=(body, *arm.limits.keep_out))
    return Cell(camera=camera, arm=arm, workspace=workspace, feeder=feeder, recorded=replayed)


def _arm(values: dict[str, Any], table: WorkspaceConfig, path: Path) -> Arm:
    source = f"{path}, arm"
    entry = find_backend(values.get("driver"), "arms", get_args(ArmDriver), f"{path}: 'arm.driver'")
    if entry is not None:
        return build(entry, Arm, values, source, table)
    driver: ArmDriver = values["driver"]
    match driver:
        case "franky" | "panda_py":
            from hal.franka import FrankaArm, FrankyArmConfig, PandaPyArmConfig

            kind = FrankyArmConfig if driver == "franky" else PandaPyArmConfig
            config = check_config(kind, values, source)
            limits = table.limits(
                joint_lower=config.joint_lower(),
                joint_upper=config.joint_upper(),
                max_force=config.max_grasp_force,
                closed_width=config.closed_width,
                max_load=config.max_load(table.reach()),
            )
            return FrankaArm(config, limits)
        case "replay":
            from hal.replay import ReplayArm, ReplayArmConfig

            return ReplayArm(check_config(ReplayArmConfig, values, source))
        case _:
            assert_never(driver)


def _camera(values: dict[str, Any], workspace: Workspace, path: Path) -> tuple[Camera, PartFeeder | None]:
    source = f"{path}, camera"
    entry = find_backend(values.get("driver"), "cameras", get_args(CameraDriver), f"{path}: 'camera.driver'")
    if entry is not None:
        return build(entry, Camera, values, source, path), None
    driver: CameraDriver = values["driver"]
    match driver:
        case "kinect2":
            from hal.kinect2 import Kinect2Camera, Kinect2Config

            config = check_config(Kinect2Config, values, source)
            beside = calibration_path(config.calibration, path)
            return Kinect2Camera(config.model_copy(update={"calibration": beside})), None
        case "replay":
            from hal.replay import ReplayCamera, ReplayCameraConfig

            return ReplayCamera(check_config(ReplayCameraConfig, values, source)), None
        case "sapien":
            from hal.sim import SapienCameraConfig, sapien_camera

            config = check_config(SapienCameraConfig, values, source)
            # A Panda is rendered, out of sight, whatever the arm.
            rendered = workspace.home if len(workspace.home) == len(READY) else np.array(READY)
            try:
                return sapien_camera(config, region=workspace.region, home=rendered)
            except ValueError as error:
                raise BadConfig(f"{source}: {error}") from error
        case _:
            assert_never(driver)


def _check_fit(arm: Arm, workspace: Workspace, path: Path) -> None:
    """Refuse a workspace whose grasps the arm would refuse later, with a part in its hand."""
    least, most = arm.limits.gripper.force[0], arm.limits.max_force
    if not least <= workspace.grasp_force <= most:
        raise BadConfig(
            f"{path}: workspace.grasp_force {workspace.grasp_force:g} N is outside {least:g} .. {most:g} N, "
            "which gripper and section 'arm' allow (arm.max_grasp_force of a Franka arm)"
        )
    if len(workspace.home) != arm.limits.n_joints:
        raise BadConfig(
            f"{path}: workspace.home has {len(workspace.home)} joints, the arm has {arm.limits.n_joints}; "
            "state joints at which it is out of the camera's sight"
        )
    if (reason := out_of_reach(arm, workspace)) is not None:
        raise BadConfig(
            f"{path}: workspace.region {list(workspace.region)} cannot be grasped everywhere, {reason}"
        )


def out_of_reach(arm: Arm, workspace: Workspace) -> str | None:
    """Reason why a place of the region cannot be grasped, lifted or approached; None if all can be.

    Looked at are its corners, the middles of its edges, and its own.
    """
    x_min, x_max, y_min, y_max = workspace.region
    for x, y in itertools.product(np.linspace(x_min, x_max, 3), np.linspace(y_min, y_max, 3)):
        lowest = float(workspace.lowest_tip_z(np.array([x, y]))) + arm.limits.gripper.pad_reach
        for z in (lowest, lowest + workspace.lift_height, workspace.table_z + APPROACH):
            for theta in (-np.pi / 2, 0.0, np.pi / 2):
                try:
                    arm.check_pose(pose_base_tcp(np.array([x, y, z, theta])))
                except OutOfWorkspace as error:
                    return f"hand turned by {theta:.2f} rad: {error}"
    return None
