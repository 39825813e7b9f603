"""A cell small enough to think about: what is recorded from it is known."""

from __future__ import annotations

import time

import numpy as np

from hal import Arm, ArmLimits, ArmState, Camera, Cell, GraspOutcome, RgbdFrame, Workspace
from hal.errors import CaptureFailed, MotionAborted
from mskgrasp.core.geometry import Pose

DOWN = np.array([0.0, 1.0, 0.0, 0.0])


class ToyArm(Arm):
    """Is where it was sent at once; its first three joints are its position. Below z = 0.05 m it is met."""

    def __init__(self) -> None:
        ones = np.ones(7)
        super().__init__(
            ArmLimits(
                joint_lower=-ones,
                joint_upper=ones,
                box_lower=-ones[:3],
                box_upper=ones[:3],
                table_z=0.0,
                max_force=70.0,
            )
        )
        self.moves = 0
        self._open = False
        self._joints, self._width = np.array([0.4, 0.0, 0.5, 0, 0, 0, 0]), 0.08
        self._quat_wxyz = DOWN

    def connect(self) -> None:
        self._open = True

    def close(self) -> None:
        self._open = False

    def _connected(self) -> bool:
        return self._open

    def _state(self) -> ArmState:
        return ArmState(
            joints=self._joints.copy(),
            T_base_tcp=Pose(position=self._joints[:3].copy(), quat_wxyz=self._quat_wxyz),
            gripper_width=self._width,
            timestamp_s=time.monotonic(),
        )

    def _forward(self, joints: np.ndarray) -> Pose:
        return Pose(position=joints[:3].copy(), quat_wxyz=DOWN)

    def _reachable(self, T_base_tcp: Pose) -> bool:
        return True

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        self.moves += 1
        self._joints, self._quat_wxyz = joints.copy(), DOWN

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self.moves += 1
        if T_base_tcp.position[2] < 0.05:
            raise MotionAborted("contact force over 20 N: the arm stopped; call recover() when it is safe")
        self._joints = np.concatenate([T_base_tcp.position, np.zeros(4)])
        self._quat_wxyz = T_base_tcp.quat_wxyz

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        position = T_base_tcp.position
        met = position[2] < 0.05
        where = np.array([*position[:2], 0.05]) if met else position
        self._joints, self._quat_wxyz = np.concatenate([where, np.zeros(4)]), T_base_tcp.quat_wxyz
        return Pose(position=where, quat_wxyz=T_base_tcp.quat_wxyz) if met else None

    def _move_gripper(self, width: float) -> None:
        self._width = width

    def _grasp(self, force: float) -> GraspOutcome:
        self._width = 0.031
        return GraspOutcome(width=0.031, holding=True)

    def _wait(self, seconds: float) -> None: ...
    def _halt(self) -> None: ...
    def _recover(self) -> None: ...


class ToyCamera(Camera):
    """Counts: every pixel of frame k is k metres away. Its fourth frame does not come."""

    def __init__(self, *, fine: bool = False) -> None:
        self._taken = 0
        self._fine = fine

    def connect(self) -> None: ...
    def close(self) -> None: ...

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        self._taken += 1
        if self._taken == 4:
            raise CaptureFailed("no frame within 5 s")
        depth = np.full((4, 6), self._taken, np.float32)
        depth[0, 0] = np.nan
        return RgbdFrame(
            colour=np.full((4, 6, 3), self._taken, np.uint8),
            depth=depth,
            intrinsics=np.array([[300.0, 0, 2.5], [0, 300.0, 1.5], [0, 0, 1]]),
            T_base_camera=Pose(position=np.array([0.5, 0, 0.8]), quat_wxyz=DOWN),
            timestamp_s=time.monotonic(),
            serial="toy",
            fine_colour=np.full((8, 12, 3), 10 * self._taken, np.uint8) if self._fine else None,
            infrared=np.full((4, 6), 1000 * self._taken, np.uint16) if self._fine else None,
        )


class ToyFeeder:
    def present(self, part: str, seed: int) -> None: ...


class ToyTracker:
    def part_pose(self) -> Pose:
        return Pose(position=np.array([0.4, 0.1, 0.02]), quat_wxyz=np.array([1.0, 0, 0, 0]))


def toy_cell() -> Cell:
    table = Workspace(
        table_z=0.0,
        region=(0.3, 0.6, -0.1, 0.1),
        home=np.array([0.4, 0.0, 0.5, 0, 0, 0, 0]),
        min_height=0.002,
        lift_height=0.1,
        grasp_force=20.0,
    )
    return Cell(camera=ToyCamera(), arm=ToyArm(), workspace=table, feeder=ToyFeeder(), tracker=ToyTracker())
