"""A camera and an arm of your own in a cell: ``python examples/own_camera_and_arm.py``."""

import time

import numpy as np

from hal import Arm, ArmLimits, ArmState, Camera, Cell, GraspOutcome, RgbdFrame, Workspace
from mskgrasp import Planner, PlannerConfig, Pose, execute_grasp, load_models

DOWN = np.array([0.0, 1.0, 0.0, 0.0])
ABOVE = Pose(position=np.array([0.5, 0.0, 0.8]), quat_wxyz=DOWN)
REGION = (0.38, 0.62, -0.12, 0.12)


class BlockCamera(Camera):
    """Sees a block of 60 x 30 x 40 mm on a flat table, 0.8 m below."""

    connect = close = lambda self: None

    def capture(self, timeout_s=5.0):
        depth = np.full((160, 160), 0.8, np.float32)
        depth[70:84, 66:94] = 0.76
        shown = dict(colour=np.zeros((160, 160, 3), np.uint8), depth=depth, T_base_camera=ABOVE, serial="1")
        intrinsics = np.array([[365.0, 0, 79.5], [0, 365.0, 79.5], [0, 0, 1]])
        return RgbdFrame(**shown, intrinsics=intrinsics, timestamp_s=time.monotonic())


class Gantry(Arm):
    """Reaches any pose at once; its seven "joints" are the pose itself, x y z qw qx qy qz."""

    pose, width = np.array([0.3, 0.3, 0.5, *DOWN]), 0.08
    connect = close = _halt = _recover = _wait = lambda self, *_: None
    _connected = _reachable = lambda self, *_: True
    _forward = staticmethod(Pose.from_vector)

    def _state(self):
        here = dict(joints=self.pose, T_base_tcp=Pose.from_vector(self.pose), gripper_width=self.width)
        return ArmState(**here, timestamp_s=time.monotonic())

    def _move_to_joints(self, joints, speed):
        self.pose = joints

    def _move_to_pose(self, T_base_tcp, speed):
        self.pose = T_base_tcp.as_vector()

    def _move_gripper(self, width):
        self.width = width

    def _grasp(self, force):
        self.width = 0.03
        return GraspOutcome(width=self.width, holding=True)


side = dict(joint_lower=np.full(7, -2.0), joint_upper=np.full(7, 2.0))
arm = Gantry(ArmLimits(**side, box_lower=-np.ones(3), box_upper=np.ones(3), table_z=0.0, max_force=70.0))
table = Workspace(table_z=0, region=REGION, home=arm.pose, min_height=0.002, lift_height=0.1, grasp_force=30)
planner = Planner(load_models(), PlannerConfig(), table_z=0.0, region=REGION)
with Cell(camera=BlockCamera(), arm=arm, workspace=table).connected() as cell:
    plan = planner.plan(cell.camera.capture(), np.random.default_rng(0))
    print(plan.summary, "holding" if execute_grasp(cell, plan.grasp).holding else "not holding", sep="\n")
