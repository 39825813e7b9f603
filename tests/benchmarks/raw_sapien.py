"""One grasp attempt in plain SAPIEN: every attempt runs to its end, nothing of ManiSkill or of the task."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import sapien
import torch
from mani_skill import PACKAGE_ASSET_DIR
from sapien import physx

from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import Overhead, Physics
from mskgrasp.parts import Part
from tasks.robot.panda import ARM_DAMPING, ARM_STIFFNESS, ARM_TORQUE_LIMIT
from tasks.scene.camera import FAR, NEAR
from tasks.scene.frames import sapien_camera_pose, to_world
from tasks.scene.part_actor import _visual

SETTLE_S, DESCEND_S, LIFT_S = 0.06, 0.4, 0.75
"""Long enough for every part; a script without feedback has to wait for the slowest."""
OPEN = 0.04


class RawSapien:
    """A Panda, a table, a camera and one part after the other."""

    def __init__(self, physics: Physics, camera: Overhead, centre_xy: tuple[float, float]):
        self.physics, self.camera, self.centre_xy = physics, camera, centre_xy

    def load(self, part: Part) -> None:
        """A fresh scene with this part."""
        p = self.physics
        physx.set_shape_config(contact_offset=p.contact_offset, rest_offset=0.0)
        physx.set_body_config(
            solver_position_iterations=p.position_iterations,
            solver_velocity_iterations=1,
            sleep_threshold=0.0,
        )
        physx.set_scene_config(enable_tgs=True, enable_pcm=p.persistent_manifold)
        system = physx.PhysxCpuSystem()
        self.scene = sapien.Scene([system, sapien.render.RenderSystem()])
        self.scene.set_timestep(1 / p.rate_hz)
        self.scene.set_ambient_light([0.5, 0.5, 0.5])
        pad = physx.PhysxMaterial(p.friction_pad_part, p.friction_pad_part, 0.0)
        table = physx.PhysxMaterial(p.friction_table, p.friction_table, 0.0)
        builder = self.scene.create_actor_builder()
        pose = sapien.Pose(p=to_world(np.array([0.45, 0.0, -0.02])))
        builder.add_box_collision(pose, np.array([0.5, 0.7, 0.02]), material=table)
        builder.add_box_visual(pose, np.array([0.5, 0.7, 0.02]))
        builder.initial_pose = sapien.Pose()
        builder.build_static(name="table")
        loader = self.scene.create_urdf_loader()
        loader.fix_root_link = True
        for name in ("panda_leftfinger", "panda_rightfinger"):
            loader.set_link_material(name, p.friction_pad_part, p.friction_pad_part, 0.0)
            loader.set_link_min_patch_radius(name, p.pad_patch_radius)
            loader.set_link_patch_radius(name, p.pad_patch_radius)
        self.robot = loader.load(str(Path(PACKAGE_ASSET_DIR) / "robots/panda/panda_v2.urdf"))
        self.robot.set_root_pose(sapien.Pose(p=to_world(np.zeros(3))))
        for link in self.robot.links:
            link.disable_gravity = True
        self.joints = self.robot.active_joints
        for i, joint in enumerate(self.joints[:7]):
            joint.set_drive_properties(
                float(ARM_STIFFNESS[i]), float(ARM_DAMPING[i]), float(ARM_TORQUE_LIMIT[i]), mode="force"
            )
        for joint in self.joints[7:]:
            joint.set_drive_properties(p.finger_stiffness, p.finger_damping, p.finger_force, mode="force")
            joint.armature = np.full(1, p.finger_armature, dtype=np.float32)
        builder = self.scene.create_actor_builder()
        builder.add_multiple_convex_collisions_from_file(str(part.hulls_path), scale=[1e-3] * 3, material=pad)
        builder.set_mass_and_inertia(
            part.mass, sapien.Pose(q=part.quat_obj_principal), part.principal_inertia.astype(np.float32)
        )
        builder.initial_pose = sapien.Pose(p=[0, 0, 1])
        self.part = builder.build(name="part")
        component = sapien.render.RenderBodyComponent()
        component.attach(_visual(part))
        self.part.add_component(component)
        sapien.render.set_camera_shader_dir("minimal")
        self.eye = self.scene.add_camera(
            "overhead", self.camera.n_pixels, self.camera.n_pixels, 0.4, NEAR, FAR
        )
        self.eye.entity.set_pose(sapien_camera_pose(self.camera.T_base_camera(self.centre_xy)))

    def attempt(self, pose: np.ndarray, grasp: np.ndarray, above: np.ndarray) -> bool:
        """Lays the part, takes the image, descends from above, grasps and lifts; whether it was lifted."""
        p = self.physics
        self.part.set_pose(sapien.Pose(p=to_world(pose[:3]), q=pose[3:]))
        body = self.part.find_component_by_type(physx.PhysxRigidDynamicComponent)
        body.set_linear_velocity(np.zeros(3))
        body.set_angular_velocity(np.zeros(3))
        self._show(0.0)
        self.scene.update_render()
        self.eye.take_picture()
        self.eye.get_picture("GbufferDepth")
        self._show(1.0)
        top = grasp.copy()
        top[2] += p.lift_height
        self._place(above)
        self._wait(SETTLE_S)
        start = self.part.pose.p[2]
        self._line(above, grasp, DESCEND_S)
        target = OPEN
        close_s = (OPEN + p.finger_force / p.finger_stiffness) / p.finger_speed  # until pads press in full
        for _ in range(round(close_s * p.rate_hz)):
            target = max(-OPEN, target - p.finger_speed / p.rate_hz)
            for joint in self.joints[7:]:
                joint.set_drive_target(target)
            self.scene.step()
        for joint in self.joints[7:]:
            joint.set_drive_target(-OPEN)
        self._line(grasp, top, LIFT_S)
        self._wait(p.hold_s)
        return bool(self.part.pose.p[2] - start > 0.8 * p.lift_height)

    def _place(self, grasp: np.ndarray) -> None:
        q = self._joints_at(grasp)
        self.robot.set_qpos(np.array([*q, OPEN, OPEN], dtype=np.float32))
        self.robot.set_qvel(np.zeros(9, dtype=np.float32))
        self._drive(q)
        for joint in self.joints[7:]:
            joint.set_drive_target(OPEN)

    def _line(self, start: np.ndarray, goal: np.ndarray, seconds: float) -> None:
        n = round(seconds * self.physics.rate_hz)
        share = (1 - np.cos(np.pi * np.arange(1, n + 1) / n)) / 2
        for q in self._joints_at(start + share[:, None] * (goal - start)):
            self._drive(q)
            self.scene.step()

    def _wait(self, seconds: float) -> None:
        for _ in range(round(seconds * self.physics.rate_hz)):
            self.scene.step()

    def _drive(self, q: np.ndarray) -> None:
        for joint, value in zip(self.joints[:7], q, strict=True):
            joint.set_drive_target(float(value))

    @staticmethod
    def _joints_at(grasp: np.ndarray) -> np.ndarray:
        return top_down(torch.as_tensor(grasp, dtype=torch.float64))[0].numpy()

    def _show(self, visible: float) -> None:
        for link in self.robot.links:
            body = link.entity.find_component_by_type(sapien.render.RenderBodyComponent)
            if body is not None:
                body.visibility = visible
