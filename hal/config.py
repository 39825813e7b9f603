"""Configurations of a cell of an arm and a camera, and of a simulated cell."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from hal.arm import POSITION_TOLERANCE
from hal.keep_out_config import KeepOutConfig, keep_outs
from hal.limits import ArmLimits
from hal.sensor_noise import SensorNoise
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import TABLE_CLEARANCE
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import REGION, Overhead

Three = tuple[float, float, float]
Seven = tuple[float, float, float, float, float, float, float]

READY: Seven = (0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398)
"""The Panda's usual ready pose, radians: the hand is behind the camera's field of view."""


def _measured(value: Any) -> Any:
    if value is None:
        raise ValueError("the table's height is not measured yet: run hal.touch (python -m hal.touch --help)")
    return value


STEEPEST = 0.05
"""Greatest rise of a table along x and along y, m a metre."""
Slope = Annotated[float, Field(ge=-STEEPEST, le=STEEPEST)]


class MeasuredGrip(Config):
    """What the hand was measured to do; `python -m hal.doctor --gripper` writes it."""

    grasp_force: float = Field(gt=0, le=70)
    """Commanded gripper force, N."""
    finger_force: float = Field(gt=0, le=200)
    """Force of each pad that a scale between them showed, N."""
    finger_speed: float = Field(gt=0, le=0.2)
    """Speed of each finger as the hand closes for a grasp, m/s."""
    max_width: float = Field(gt=0, le=0.2)
    """Distance of the pads of the open hand, m."""


class WorkspaceConfig(Config):
    """Table in front of the arm and limits of the TCP."""

    table_z: Annotated[float, Field(ge=-0.5, le=0.5), BeforeValidator(_measured)]
    """Height of the table in the region's middle, base frame, m; `python -m hal.touch` measures it."""
    table_slope: tuple[Slope, Slope] = (0.0, 0.0)
    """Rise of the table along x and along y, m a metre; `python -m hal.touch` measures it."""
    clearance: float = Field(default=0.003, gt=POSITION_TOLERANCE, le=0.05)
    """Least distance of the pads from the table, m; more than the arm's tolerance of arrival."""
    region: tuple[float, float, float, float] = (0.38, 0.62, -0.12, 0.12)
    """x_min, x_max, y_min, y_max where parts lie, base frame, m."""
    home: tuple[float, ...] = READY
    """Joints at which the arm is out of the camera's sight, rad; as many as it has."""
    box_lower: Three | None = None
    """The TCP stays inside this box, base frame, m; by default 0.25, -0.4 and the table."""
    box_upper: Three = (0.75, 0.4, 0.75)
    """The other corner, m."""
    min_height: float = Field(default=0.006, gt=0)
    """Points lower than this over the table count as table, m: real tables are not level, cameras drift."""
    lift_height: float = Field(default=0.1, gt=0, le=0.3)
    """Height by which a grasped part is lifted, m."""
    grasp_force: float = Field(default=30.0, gt=0)
    """Gripper force, N; at most the arm's."""
    keep_out: tuple[KeepOutConfig, ...] = ()
    """Spheres, capsules and boxes that no link enters, such as posts; the camera makes its own."""
    measured_grip: MeasuredGrip | None = None
    """What the hand truly applies; null: not measured. Simulation can use it, docs/real_cell.md says how."""

    @model_validator(mode="after")
    def _check(self) -> WorkspaceConfig:
        x_min, x_max, y_min, y_max = self.region
        if not (x_min < x_max and y_min < y_max):
            raise ValueError(f"region must be x_min < x_max, y_min < y_max, got {list(self.region)}")
        lower, upper = self.lower(), np.array(self.box_upper)
        if not (lower < upper).all():
            raise ValueError(
                f"box_lower {lower.tolist()} must be below box_upper {upper.tolist()} in x, y and z"
            )
        if not (lower[0] <= x_min and x_max <= upper[0] and lower[1] <= y_min and y_max <= upper[1]):
            raise ValueError(
                f"region {list(self.region)} reaches out of the box {lower.tolist()} .. {upper.tolist()}"
            )
        return self

    def lower(self) -> np.ndarray:
        """(3,) lower corner of the box, base frame, m."""
        return np.array(self.box_lower if self.box_lower is not None else (0.25, -0.4, self.table_z))

    def limits(self, *, joint_lower: np.ndarray, joint_upper: np.ndarray, **of_arm: Any) -> ArmLimits:
        """Limits of an arm at this table.

        Args:
            joint_lower: (n,) radians.
            joint_upper: (n,) radians.
            of_arm: Further ones of the arm: ``max_force``, ``gripper``, ``closed_width``, ``max_load``.
        """
        x_min, x_max, y_min, y_max = self.region
        return ArmLimits(
            joint_lower=joint_lower,
            joint_upper=joint_upper,
            box_lower=self.lower(),
            box_upper=np.array(self.box_upper),
            table_z=self.table_z,
            clearance=self.clearance,
            table_slope=np.array(self.table_slope),
            table_centre=np.array([(x_min + x_max) / 2, (y_min + y_max) / 2]),
            keep_out=keep_outs(self.keep_out),
            **of_arm,
        )

    def reach(self) -> float:
        """Horizontal distance of the box's farthest corner from the base, m."""
        corners = np.abs(np.array([self.lower(), self.box_upper]))[:, :2].max(axis=0)
        return float(np.hypot(*corners))


class DevicesConfig(Config):
    """Sections of the file; the ``driver`` of ``arm`` and ``camera`` decides how each is checked."""

    type: Literal["devices"]
    arm: dict[str, Any]
    camera: dict[str, Any]
    workspace: WorkspaceConfig


class TableError(Config):
    """Difference of a simulated table from what the cell states, as real tables have it; for tests."""

    height: float = Field(default=0.0, ge=-0.005, le=0.005)
    """Height in the region's middle over the stated one, m."""
    slope: tuple[float, float] = (0.0, 0.0)
    """Rise along x and along y, m a metre, each between -0.02 and 0.02."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if max(map(abs, self.slope)) > 0.02:
            raise ValueError(f"slope {list(self.slope)} must be within -0.02 .. 0.02 m a metre")
        return self

    def motion(self, centre: np.ndarray, table_z: float) -> Pose:
        """Motion from the stated table, level at ``table_z``, to the true one, turned about a centre (2,)."""
        normal = np.array([-self.slope[0], -self.slope[1], 1.0])
        normal /= np.linalg.norm(normal)
        # The shortest turn of z to the normal.
        quat = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0])
        middle = np.array([*centre, table_z])
        there = Pose(position=middle + [0, 0, self.height], quat_wxyz=quat / np.linalg.norm(quat))
        return there @ Pose(position=-middle, quat_wxyz=np.array([1.0, 0, 0, 0]))


class SimulatedCellConfig(Config):
    """Settings that the cells of all simulators share."""

    part: str = "hex_nut_m30"
    """Part on the table when the cell is opened: a name or a folder."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the position and turn of the part."""
    region: tuple[float, float, float, float] = REGION
    """x_min, x_max, y_min, y_max where parts lie, base frame, m."""
    home: Seven = READY
    """Joints at which the arm is out of the camera's sight, rad."""
    min_height: float | None = Field(default=None, gt=0)
    """Points lower than this over the table count as table, m; null: 2 mm, or 3 mm with camera noise."""
    lift_height: float = Field(default=0.1, gt=0, le=0.3)
    """Height by which a grasped part is lifted, m."""
    grasp_force: float = Field(default=30.0, gt=0, le=70)
    """Gripper force, N."""
    clearance: float = Field(default=TABLE_CLEARANCE, ge=TABLE_CLEARANCE, le=0.05)
    """Least distance of the pads from the table, m."""
    keep_out: tuple[KeepOutConfig, ...] = ()
    """Spheres, capsules and boxes that no link enters; the camera makes its own."""
    table_error: TableError = TableError()
    """Error of the table unknown to programs; none by default."""
    camera: Overhead = Overhead()
    """The overhead depth camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model of the camera: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        corners = [(x, y) for x in self.region[:2] for y in self.region[2:]]
        grasps = np.array([[x, y, z, t] for x, y in corners for z in (0.0105, 0.3) for t in (-1.57, 1.57)])
        if not top_down(grasps)[1].all():
            raise ValueError(
                f"region {list(self.region)} reaches beyond the arm; the default is {list(REGION)}"
            )
        self.camera.check_sees(self.region)
        return self
