"""An arm of your own, in a cell with the camera of own_camera.py: ``python examples/own_arm.py``."""

import time

import numpy as np
from own_camera import REGION, BlockCamera, plan_grasp

from hal import Arm, ArmLimits, ArmState, Cell, GraspOutcome, Workspace
from mskgrasp import Pose, execute_grasp

HOME = np.array([0.3, 0.3, 0.5, 0.0, 1.0, 0.0, 0.0])
LIMITS = ArmLimits(joint_lower=np.full(7, -2.0), joint_upper=np.full(7, 2.0), box_lower=-np.ones(3),
                   box_upper=np.ones(3), table_z=0.0, max_force=70.0)  # fmt: skip
TABLE = Workspace(table_z=0.0, region=REGION, home=HOME, min_height=0.002, lift_height=0.1, grasp_force=30)


class Gantry(Arm):
    """Is anywhere at once; its seven "joints" are the pose itself, x y z qw qx qy qz."""

    pose, width = HOME, 0.08

    # A real arm opens its driver, lets go of it, brakes, acknowledges errors, holds still, feels the table.
    def connect(self): ...
    def close(self): ...
    def _halt(self): ...
    def _recover(self): ...
    def _wait(self, seconds): ...
    def _move_until_contact(self, T_base_tcp, force, speed): ...

    def _connected(self):
        return True

    def _reachable(self, T_base_tcp):
        return True

    def _forward(self, joints):
        return Pose.from_vector(joints)

    def _state(self):
        here, now = Pose.from_vector(self.pose), time.monotonic()
        return ArmState(joints=self.pose, T_base_tcp=here, gripper_width=self.width, timestamp_s=now)

    def _move_to_joints(self, joints, speed):
        self.pose = joints

    def _move_to_pose(self, T_base_tcp, speed):
        self.pose = T_base_tcp.as_vector()

    def _move_gripper(self, width):
        self.width = width

    def _grasp(self, force):
        print(f"fingers close at {self.pose[:3].round(4)} m, quaternion wxyz {self.pose[3:].round(5)}")
        return GraspOutcome(width=0.03, holding=True)


if __name__ == "__main__":
    with Cell(camera=BlockCamera(), arm=Gantry(LIMITS), workspace=TABLE).connected() as cell:
        result = execute_grasp(cell, plan_grasp(cell.camera.capture()).grasp)
    print("holding" if result.holding else "not holding")
