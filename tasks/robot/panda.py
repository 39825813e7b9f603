"""The Panda of the task: ManiSkill's, with pads, fingers and arm modelled on the real ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sapien
import torch
from gymnasium import spaces
from mani_skill.agents.controllers.base_controller import BaseController, ControllerConfig
from mani_skill.agents.registration import register_agent
from mani_skill.agents.robots.panda.panda import Panda
from mani_skill.utils.building.urdf_loader import ParsedURDFData, URDFLoader
from sapien.wrapper.articulation_builder import ArticulationBuilder

from mskgrasp.core.grasp import MAX_OPENING, lowest_grasp_z
from mskgrasp.core.panda_kinematics import HOME
from mskgrasp.core.settings import REGION, Physics

ARM_TORQUE_LIMIT = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
"""Greatest torques of the joints, N m; Franka Emika Panda datasheet."""
ARM_STIFFNESS = np.full(7, 1e4)
"""Stiffness of the drives, N m/rad. The real controller knows the arm's inertia and follows a path to 0.1 mm;
these drives do not, and need this stiffness to overshoot by less than 0.4 mm at the end of a descent."""
ARM_DAMPING = np.array([250.0, 250.0, 220.0, 200.0, 80.0, 80.0, 60.0])
"""Damping of the drives, N m s/rad; about critical for the inertia that each joint sees in the workspace."""
FINGER_LINKS = ("panda_leftfinger", "panda_rightfinger")
HAND_LINKS = ("panda_hand", *FINGER_LINKS)
BARE_FRAMES = ("panda_link8", "panda_leftfinger_pad", "panda_rightfinger_pad")
"""Links of the URDF without mass or shape, which nothing here refers to. The solver passes over every link of
an arm in every iteration: without these three of fifteen a step takes a tenth less."""


class GraspController(BaseController):
    """Control mode ``grasp``: the action is a grasp in the base frame; the task executes it.

    Action: x, y, z in metres and theta in radians.
    """

    config: GraspControllerConfig
    sets_target_qpos = True
    sets_target_qvel = True

    def _initialize_action_space(self) -> None:
        self.single_action_space = spaces.Box(
            np.array(self.config.lower, dtype=np.float32), np.array(self.config.upper, dtype=np.float32)
        )

    def set_drive_property(self) -> None:
        """The drives are set by `GraspPanda.set_drives` for every mode."""

    def set_action(self, action: torch.Tensor) -> None:
        """Do nothing: `tasks.grasp_displacement` runs the whole attempt."""


@dataclass
class GraspControllerConfig(ControllerConfig):
    """Bounds of the grasps, base frame."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    controller_cls = GraspController


@register_agent()
class GraspPanda(Panda):
    """Panda with the friction, contact patch, inertia and force limits of the real hand and arm."""

    uid = "panda_grasp"
    physics = Physics()
    region = REGION

    @property
    def urdf_config(self) -> dict:
        """Hand and fingers with the friction that the physics settings state."""
        # PhysX averages both materials, and a part's has no friction.
        mu = 2 * self.physics.friction_pad_part
        pad = dict(
            material="pad",
            patch_radius=self.physics.pad_patch_radius,
            min_patch_radius=self.physics.pad_patch_radius,
        )
        return dict(
            _materials=dict(pad=dict(static_friction=mu, dynamic_friction=mu, restitution=0.0)),
            link=dict.fromkeys(FINGER_LINKS, pad) | {"panda_hand": dict(material="pad")},
        )

    @property
    def _controller_configs(self) -> dict:
        x_min, x_max, y_min, y_max = self.region
        configs = super()._controller_configs
        for config in configs.values():
            for name in ("stiffness", "damping", "force_limit"):
                if hasattr(config["arm"], name):
                    setattr(config["arm"], name, _ARM_DRIVE[name].tolist())
            gripper = config["gripper"]
            gripper.lower = -MAX_OPENING / 2
            gripper.stiffness = self.physics.finger_stiffness
            gripper.damping = self.physics.finger_damping
            gripper.force_limit = self.physics.finger_force
        grasp = GraspControllerConfig(
            joint_names=self.arm_joint_names,
            lower=(x_min, y_min, lowest_grasp_z(0.0), -math.pi / 2),
            upper=(x_max, y_max, 0.15, math.pi / 2),
        )
        # The first mode is the default.
        return dict(grasp=grasp, **configs)

    def _load_articulation(self, *args: Any, **kwargs: Any) -> None:
        def loader() -> URDFLoader:
            made = _Loader()
            made.set_scene(self.scene)
            return made

        # ManiSkill asks the scene for its loader inside of this method.
        usual = self.scene.create_urdf_loader
        self.scene.create_urdf_loader = loader
        try:
            super()._load_articulation(*args, **kwargs)
        finally:
            self.scene.create_urdf_loader = usual

    def _after_init(self) -> None:
        super()._after_init()
        self.arm_joints = [self.robot.active_joints_map[name] for name in self.arm_joint_names]
        self.finger_joints = [self.robot.active_joints_map[name] for name in self.gripper_joint_names]
        for joint in self.finger_joints:
            for one in joint._objs:
                one.armature = np.full(1, self.physics.finger_armature, dtype=np.float32)
        self.set_drives()

    def set_drives(self) -> None:
        """Give arm and fingers the drives of the physics settings."""
        for i, joint in enumerate(self.arm_joints):
            joint.set_drive_properties(
                float(ARM_STIFFNESS[i]), float(ARM_DAMPING[i]), float(ARM_TORQUE_LIMIT[i]), mode="force"
            )
            joint.set_friction(0.0)
        self.set_finger_force(self.physics.finger_force)

    def set_finger_force(self, force: float) -> None:
        """Limit the force of each pad, N."""
        for joint in self.finger_joints:
            joint.set_drive_properties(
                self.physics.finger_stiffness, self.physics.finger_damping, force, mode="force"
            )

    def set_pad_friction(self, coefficient: float) -> None:
        """Set the effective coefficient between pads and part."""
        material = 2 * coefficient  # as in `urdf_config`
        for name in FINGER_LINKS:
            for link in self.robot.links_map[name]._objs:
                for shape in link.collision_shapes:
                    shape.physical_material.set_static_friction(material)
                    shape.physical_material.set_dynamic_friction(material)

    @property
    def rest_qpos(self) -> np.ndarray:
        """(9,) arm at home, fingers open."""
        return np.array([*HOME, MAX_OPENING / 2, MAX_OPENING / 2], dtype=np.float32)

    def show(self, visible: bool) -> None:
        """Show or hide the robot in rendered images; the overhead image is taken before the arm enters."""
        for body in self._render_bodies:
            body.visibility = 1.0 if visible else 0.0

    @cached_property
    def _render_bodies(self) -> list[sapien.render.RenderBodyComponent]:
        entities = [one.entity for link in self.robot.links for one in link._objs]
        found = [one.find_component_by_type(sapien.render.RenderBodyComponent) for one in entities]
        return [body for body in found if isinstance(body, sapien.render.RenderBodyComponent)]


def drop_bare_frames(builder: ArticulationBuilder) -> None:
    """Remove `BARE_FRAMES`; their child links become those of their parents."""
    links = builder.link_builders
    for bare in [link for link in links if link.name in BARE_FRAMES]:
        joint = bare.joint_record
        for child in [link for link in links if link.parent is bare]:
            child.parent = bare.parent
            fixed = joint.pose_in_parent * joint.pose_in_child.inv()
            child.joint_record.pose_in_parent = fixed * child.joint_record.pose_in_parent
        links.remove(bare)
    for index, link in enumerate(links):
        link.index = index


class _Loader(URDFLoader):
    """ManiSkill's loader, which leaves out `BARE_FRAMES`."""

    def parse(self, *args: Any, **kwargs: Any) -> ParsedURDFData:
        found = super().parse(*args, **kwargs)
        for builder in found["articulation_builders"]:
            drop_bare_frames(builder)
        return found


_ARM_DRIVE = dict(stiffness=ARM_STIFFNESS, damping=ARM_DAMPING, force_limit=ARM_TORQUE_LIMIT)


def panda_for(physics: Physics, region: tuple[float, float, float, float]) -> type[GraspPanda]:
    """The agent class for these settings: ManiSkill instantiates agents by class, without arguments."""
    return type("GraspPanda", (GraspPanda,), dict(physics=physics, region=region))
