"""Grasp attempts in plain SAPIEN, with the task's physics and shortcuts but without its loop and ManiSkill's.

What any program on this engine can reach: skipped air, an end as soon as the outcome is certain, a lift in
coarse steps.
"""

from __future__ import annotations

from collections import deque
from pathlib import Path

import numpy as np
import sapien
import torch
from mani_skill import PACKAGE_ASSET_DIR
from sapien import physx

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING, MIN_GAP, MIN_RISE, lowest_grasp_z, pose_base_grasp
from mskgrasp.core.minimum_jerk import minimum_jerk, minimum_jerk_duration
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import Overhead, Physics
from mskgrasp.parts import Part
from mskgrasp.parts.hulls import hull_corners
from tasks.attempt.attempt import AHEAD, ARRIVAL_S, LOOK_S, LOST_MARGIN, SPEED_WINDOW_S, TAKE_OFF
from tasks.attempt.clearance import hand_clearance
from tasks.robot.motion import CHECK_S, PEAK_ACCELERATION, STILL_FINGER, finger_lag, run_up
from tasks.robot.panda import ARM_DAMPING, ARM_STIFFNESS, ARM_TORQUE_LIMIT, HAND_LINKS, drop_bare_frames
from tasks.robot.reflex import NEAR_S, WINDOW_S
from tasks.scene.camera import FAR, NEAR
from tasks.scene.frames import sapien_camera_pose, to_world
from tasks.scene.part_actor import _visual
from tasks.scene.table_friction import TableFriction

OPEN = MAX_OPENING / 2


class RawSapien:
    """A Panda, a table, a camera and one part after the other."""

    def __init__(self, physics: Physics, camera: Overhead, centre_xy: tuple[float, float]):
        self.physics, self.camera, self.centre_xy = physics, camera, centre_xy

    def load(self, part: Part) -> None:
        """A fresh scene with this part."""
        p = self.physics
        self.hulls = hull_corners(part)
        physx.set_shape_config(contact_offset=p.contact_offset, rest_offset=0.0)
        physx.set_body_config(
            solver_position_iterations=p.position_iterations,
            solver_velocity_iterations=1,
            sleep_threshold=0.0,
        )
        physx.set_scene_config(enable_tgs=True, enable_pcm=p.persistent_manifold)
        self.system = physx.PhysxCpuSystem()
        self.scene = sapien.Scene([self.system, sapien.render.RenderSystem()])
        self._rate(p.rate_hz)
        self.scene.set_ambient_light([0.5, 0.5, 0.5])
        slippery = physx.PhysxMaterial(0.0, 0.0, 0.0)
        builder = self.scene.create_actor_builder()
        pose = sapien.Pose(p=to_world(np.array([0.45, 0.0, -0.02])))
        builder.add_box_collision(pose, np.array([0.5, 0.7, 0.02]), material=slippery)
        builder.add_box_visual(pose, np.array([0.5, 0.7, 0.02]))
        builder.initial_pose = sapien.Pose()
        table = builder.build_static(name="table").find_component_by_type(physx.PhysxRigidStaticComponent)
        assert isinstance(table, physx.PhysxRigidStaticComponent)
        self._load_robot()
        builder = self.scene.create_actor_builder()
        builder.add_multiple_convex_collisions_from_file(
            str(part.hulls_path), scale=[1e-3] * 3, material=slippery
        )
        builder.set_mass_and_inertia(
            part.mass, sapien.Pose(q=part.quat_obj_principal), part.principal_inertia.astype(np.float32)
        )
        builder.initial_pose = sapien.Pose(p=[0, 0, 1])
        self.part = builder.build(name="part")
        body = self.part.find_component_by_type(physx.PhysxRigidDynamicComponent)
        assert isinstance(body, physx.PhysxRigidDynamicComponent)
        self.body = body
        self.friction = TableFriction(self.system, body, table, p.friction_table_part)
        component = sapien.render.RenderBodyComponent()
        component.attach(_visual(part))
        self.part.add_component(component)
        sapien.render.set_camera_shader_dir("minimal")
        self.eye = self.scene.add_camera(
            "overhead", self.camera.n_pixels, self.camera.n_pixels, 0.4, NEAR, FAR
        )
        self.eye.entity.set_pose(sapien_camera_pose(self.camera.T_base_camera(self.centre_xy)))

    def _load_robot(self) -> None:
        p = self.physics
        loader = self.scene.create_urdf_loader()
        for name in ("panda_leftfinger", "panda_rightfinger"):
            loader.set_link_material(name, 2 * p.friction_pad_part, 2 * p.friction_pad_part, 0.0)
            loader.set_link_min_patch_radius(name, p.pad_patch_radius)
            loader.set_link_patch_radius(name, p.pad_patch_radius)
        urdf = str(Path(PACKAGE_ASSET_DIR) / "robots/panda/panda_v2.urdf")
        builder = loader.load_file_as_articulation_builder(urdf)
        drop_bare_frames(builder)
        builder.initial_pose = sapien.Pose(p=to_world(np.zeros(3)))
        self.robot = builder.build(fix_root_link=True)
        for link in self.robot.links:
            link.disable_gravity = True
        links = {link.name: link for link in self.robot.links}
        self.hand = {links[name] for name in HAND_LINKS}
        self.tcp = links["panda_hand_tcp"].entity
        self.joints = self.robot.active_joints
        for i, joint in enumerate(self.joints[:7]):
            joint.set_drive_properties(
                float(ARM_STIFFNESS[i]), float(ARM_DAMPING[i]), float(ARM_TORQUE_LIMIT[i]), mode="force"
            )
        for joint in self.joints[7:]:
            joint.set_drive_properties(p.finger_stiffness, p.finger_damping, p.finger_force, mode="force")
            joint.armature = np.full(1, p.finger_armature, dtype=np.float32)

    def attempt(self, pose: np.ndarray, grasp: np.ndarray) -> bool:
        """Places the part, takes the image, grasps and lifts; whether the part was lifted."""
        p = self.physics
        self.robot.set_solver_position_iterations(p.position_iterations)
        self.part.set_pose(sapien.Pose(p=to_world(pose[:3]), q=pose[3:]))
        self.body.set_linear_velocity(np.zeros(3))
        self.body.set_angular_velocity(np.zeros(3))
        self._show(0.0)
        self.scene.update_render()
        self.eye.take_picture()
        self.eye.get_picture("GbufferDepth")
        self._show(1.0)
        in_hand = pose_base_grasp(grasp).inverse() @ Pose.from_vector(pose)
        corners = [in_hand.apply(hull) for hull in self.hulls]
        clear = hand_clearance(corners)
        above = grasp.copy()
        if not clear.free:
            top = max(float(hull[:, 2].max()) for hull in corners)
            above[2] += max(0.0, top + lowest_grasp_z(0.0) + p.approach_clearance)
        step = p.finger_speed / p.rate_hz
        runs = clear.free and 0 < clear.reach and clear.reach + max(run_up(p), AHEAD + step) <= OPEN
        first = OPEN + finger_lag(p)
        opening = first - (first - clear.reach - AHEAD) // step * step if runs else OPEN
        self._place(above, opening)
        self._wait(p.settle_s)
        start = self.part.pose.p[2]
        if clear.free and not clear.reach:
            return False
        if not clear.free and not self._descend(above, grasp):
            return False
        if runs:
            qvel = self.robot.qvel
            qvel[7:] = -p.finger_speed
            self.robot.qvel = qvel
        if not self._close(opening - (finger_lag(p) if runs else 0.0)):
            return False
        return self._lift(grasp) and bool(self.part.pose.p[2] - start >= MIN_RISE * p.lift_height)

    def _descend(self, above: np.ndarray, grasp: np.ndarray) -> bool:
        """Whether the hand arrived without meeting more than the reflex allows."""
        p = self.physics
        n = self._n(minimum_jerk_duration(above[2] - grasp[2], p.descend_speed, PEAK_ACCELERATION))
        loads: deque = deque(maxlen=self._n(WINDOW_S))
        every, near = self._n(NEAR_S), False
        path = self._joints_at(above + minimum_jerk(np.arange(1, n + 1) / n)[:, None] * (grasp - above))
        drives = self._moving(path)
        for k in range(n + self._n(ARRIVAL_S)):
            if k < n:
                self._drive(drives, k)
            elif k == n:
                self._stop(path[-1])
            self._step()
            if k % every == 0:
                near = bool(self._on_hand())
            if not near:
                loads.clear()
                continue
            loads.append(self._load())
            force = np.sum(loads, axis=0) / loads.maxlen
            if np.linalg.norm(force) > p.reflex_force:
                return False
        return True

    def _close(self, target: float) -> bool:
        """Whether something is between the fingers when they have come to rest."""
        p = self.physics
        every, lag = self._n(CHECK_S), p.finger_force / p.finger_stiffness
        far = STILL_FINGER * CHECK_S
        last = self.robot.qpos[7:]
        for k in range(2 * p.rate_hz):
            target = max(-OPEN, target - p.finger_speed / p.rate_hz)
            for joint in self.joints[7:]:
                joint.set_drive_target(target)
            self._step()
            if k % every != every - 1:
                continue
            fingers = self.robot.qpos[7:]
            if fingers.sum() <= MIN_GAP:
                return False
            if (abs(fingers - last) < far).all() and fingers.mean() - target > lag:
                break
            last = fingers
        for joint in self.joints[7:]:
            joint.set_drive_target(-OPEN)
        return bool(self.robot.qpos[7:].sum() > MIN_GAP)

    def _lift(self, grasp: np.ndarray) -> bool:
        """Whether something is still in the hand at the end; ends early where it is lost."""
        p = self.physics
        self.robot.set_solver_position_iterations(max(p.position_iterations, p.hold_iterations))
        seconds = minimum_jerk_duration(p.lift_height, p.lift_speed, PEAK_ACCELERATION)
        n = self._n(seconds)
        fine = np.arange(1, n + 1) / n
        fine = fine[: 1 + int(np.searchsorted(p.lift_height * minimum_jerk(fine), TAKE_OFF))]
        behind = self._behind() + (1 - MIN_RISE) * p.lift_height + LOST_MARGIN
        if not self._rise(grasp, fine, behind):
            return False
        self._rate(p.coarse_rate_hz)
        m = self._n((1 - fine[-1]) * seconds)
        held = self._rise(grasp, fine[-1] + (1 - fine[-1]) * np.arange(1, m + 1) / m, behind)
        if held:
            self._wait(p.hold_s - SPEED_WINDOW_S)
        self._rate(p.rate_hz)
        if held:
            self._wait(SPEED_WINDOW_S)
        return held and bool(self.robot.qpos[7:].sum() > MIN_GAP)

    def _rise(self, grasp: np.ndarray, times: np.ndarray, most_behind: float) -> bool:
        up = np.zeros((len(times), 4))
        up[:, 2] = self.physics.lift_height * minimum_jerk(times)
        every = self._n(LOOK_S)
        path = self._joints_at(grasp + up)
        drives = self._moving(path)
        for k in range(len(path)):
            self._drive(drives, k)
            self._step()
            if k % every == every - 1:
                if self.robot.qpos[7:].sum() <= MIN_GAP or self._behind() > most_behind:
                    return False
        self._stop(path[-1])
        return True

    def _behind(self) -> float:
        return float(self.tcp.pose.p[2] - self.part.pose.p[2])

    def _on_hand(self) -> list:
        contacts = self.system.get_contacts()
        return [one for one in contacts if (one.bodies[0] in self.hand) is not (one.bodies[1] in self.hand)]

    def _load(self) -> np.ndarray:
        total = np.zeros(3)
        for one in self._on_hand():
            sign = 1.0 if one.bodies[0] in self.hand else -1.0
            for point in one.points:
                total += sign * point.impulse
        return total * self.rate_hz

    def _rate(self, rate_hz: int) -> None:
        self.rate_hz = rate_hz
        self.system.timestep = 1 / rate_hz

    def _n(self, seconds: float) -> int:
        return max(1, round(seconds * self.rate_hz))

    def _place(self, grasp: np.ndarray, opening: float) -> None:
        q = self._joints_at(grasp[None])[0]
        self.robot.set_qpos(np.array([*q, opening, opening], dtype=np.float32))
        self.robot.set_qvel(np.zeros(9, dtype=np.float32))
        self._stop(q)
        for joint in self.joints[7:]:
            joint.set_drive_target(opening)
        self.friction.reset()

    def _step(self) -> None:
        self.friction.apply()
        self.system.step()

    def _wait(self, seconds: float) -> None:
        for _ in range(self._n(seconds)):
            self._step()

    def _moving(self, path: np.ndarray) -> list[tuple]:
        """The joints that a path moves, with their places and speeds."""
        speed = np.diff(path, axis=0, prepend=self.targets[None]) * self.rate_hz
        iterations = self.robot.solver_position_iterations
        aims = path - speed * (1 - 1 / iterations) / 2 / self.rate_hz
        moving = np.flatnonzero(np.ptp(path, axis=0)).tolist()
        return [(self.joints[j], aims[:, j].tolist(), speed[:, j].tolist()) for j in moving]

    @staticmethod
    def _drive(drives: list[tuple], k: int) -> None:
        for joint, aims, speeds in drives:
            joint.set_drive_target(aims[k])
            joint.set_drive_velocity_target(speeds[k])

    def _stop(self, q: np.ndarray) -> None:
        self.targets = q
        for joint, value in zip(self.joints[:7], q.tolist(), strict=True):
            joint.set_drive_target(value)
            joint.set_drive_velocity_target(0.0)

    @staticmethod
    def _joints_at(grasps: np.ndarray) -> np.ndarray:
        return top_down(torch.as_tensor(grasps, dtype=torch.float64))[0].numpy()

    def _show(self, visible: float) -> None:
        for link in self.robot.links:
            body = link.entity.find_component_by_type(sapien.render.RenderBodyComponent)
            if isinstance(body, sapien.render.RenderBodyComponent):
                body.visibility = visible
