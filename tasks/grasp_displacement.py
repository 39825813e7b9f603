"""The ManiSkill task: one action is one grasp, and its outcome is how the part moved in the hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import sapien
import torch
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.sensors.camera import Camera, CameraConfig
from mani_skill.utils import sapien_utils
from mani_skill.utils.registration import register_env
from mani_skill.utils.structs.actor import Actor
from mani_skill.utils.structs.pose import Pose as ManiSkillPose
from mani_skill.utils.structs.types import SimConfig
from sapien.physx import PhysxMaterial, PhysxRigidDynamicComponent, PhysxRigidStaticComponent
from torch import Tensor

from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MIN_RISE, lowest_grasp_z
from mskgrasp.core.panda_kinematics import HOME
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionError, ExecutionNoise, Overhead, Physics, Region
from mskgrasp.parts import Part, find_part, starter_names
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.parts.resting_pose import random_resting_pose
from tasks.attempt.attempt import Attempt
from tasks.checks import check_region, check_reset, check_tops, grasps_of, poses_of
from tasks.robot.contacts import HandContacts
from tasks.robot.motion import PandaMotion
from tasks.robot.panda import GraspPanda, panda_for
from tasks.scene.camera import camera_config, where_seen, without_reflection_table
from tasks.scene.frames import BASE_IN_WORLD, base_pose, sapien_camera_pose, to_world
from tasks.scene.part_actor import add_part
from tasks.scene.physics import MOST_HULLS, sim_config
from tasks.scene.standing import StandingPoses, standing_poses
from tasks.scene.table_friction import TableFriction

_EXACT = ExecutionNoise()


@register_env("GraspDisplacement-v1", max_episode_steps=250)
class GraspDisplacementEnv(BaseEnv):
    """Grasp an industrial part from a table and measure how it shifts in the hand.

    **Task Description:**
    A part lies on the table. In control mode ``grasp`` an action is one top-down grasp (x, y, z, theta
    in the robot's base frame) and one ``env.step`` is the whole attempt: pre-grasp, straight descent,
    close, lift, hold. The other control modes of the Panda (joint and end-effector) work as usual.

    **Randomizations:**
    - the part: one for each sub-scene, given by ``parts`` or drawn from the starter set
    - its resting pose, by the poses' probabilities; poses that the engine does not hold are left out
    - its place, uniform in a 24 x 24 cm region, and its turn about the vertical
    - if ``noise`` enables them: errors of arm, gripper force, friction and camera (`core.settings`)

    **Success Conditions:**
    - after the lift and 0.2 s of holding, both pads touch the part and their gap is over 0.5 mm
    - the part has risen by at least 80 % of the lift and moves slower than 5 cm/s against the hand
    - no overlap of finger and part over 1 mm was seen

    **Fail Conditions:**
    In mode ``grasp``: every attempt that is no success, with its reason (``missed``, ``slipped``,
    ``ejected``, ``collided``) in ``info["failure"]``. An attempt whose part was not at rest before anything
    touched it (``unsettled``) says nothing about the grasp. A grasp that the arm cannot execute is not tried,
    in one sub-scene or in many, and raises nothing (``unreachable``; ``info["executable"]`` is false).

    **Goal Specification:**
    None. ``info["displacement"]`` holds dx, dy, dz, dtheta of the part in the hand.

    **Additional Notes:**
    - ``obs_mode`` alone renders nothing; `capture_depth` takes the overhead image in float metres
    - ``reset(options=dict(pose_base_obj=...))`` places the part at this pose, ``options=dict(parts=[...],
      reconfigure=True)`` loads other parts
    """

    _sample_video_link = None
    SUPPORTED_REWARD_MODES: ClassVar = ("sparse", "none")
    agent: GraspPanda  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(
        self,
        *args: Any,
        parts: Sequence[str] | None = None,
        physics: dict | None = None,
        camera: dict | None = None,
        noise: dict | None = None,
        region: Region = REGION,
        robot_uids: str = "panda_grasp",
        num_envs: int = 1,
        **kwargs: Any,
    ):
        """Build the environment.

        Args:
            *args: Passed to ManiSkill.
            parts: Names or folders of parts, for the sub-scenes in turn; None: drawn from the starter set.
            physics: Overrides of `mskgrasp.core.settings.Physics`.
            camera: Overrides of `mskgrasp.core.settings.Overhead`.
            noise: Overrides of `mskgrasp.core.settings.ExecutionNoise`, all of which is off.
            region: Bounds of the parts' positions, base frame.
            robot_uids: Only ``panda_grasp``.
            num_envs: Sub-scenes; more than one needs PhysX on a GPU.
            **kwargs: Passed to ManiSkill.

        Raises:
            BadConfig: An override is not valid, its noise cannot be simulated, the camera does not see the
                region, or there is no GPU for several sub-scenes.
            BadPart: A part is unknown or damaged.
        """
        if robot_uids != "panda_grasp":
            raise ValueError(f"robot_uids must be 'panda_grasp', got {robot_uids!r}")
        self.physics = check_config(Physics, physics or {}, "physics")
        self.overhead = check_config(Overhead, camera or {}, "camera")
        self.noise = check_config(ExecutionNoise, noise or {}, "noise")
        self._check_noise(num_envs)
        self.region = tuple(region)
        check_region(self.overhead, self.region)
        if num_envs > 1 and not torch.cuda.is_available():
            raise BadConfig(
                f"num_envs: {num_envs} scenes need PhysX on a GPU, and CUDA is not available; use 1"
            )
        self.intrinsics = self.overhead.intrinsics()
        self.T_base_camera = self.overhead.T_base_camera(self.region_centre)
        self._part_names = [parts] if isinstance(parts, str) else list(parts) if parts else None
        self._n_scenes = num_envs
        # ManiSkill sizes PhysX's buffers once: every sub-scene has room for the most complex of these parts.
        names = self._part_names or []
        self._most_hulls = max((find_part(name).n_hulls for name in names), default=MOST_HULLS)
        self.parts: list[Part] = []
        self._standing: dict[str, StandingPoses] = {}
        self._outcome: dict[str, Tensor] | None = None
        super().__init__(*args, robot_uids=panda_for(self.physics, self.region), num_envs=num_envs, **kwargs)

    def _check_noise(self, num_envs: int) -> None:
        noise = self.noise
        if num_envs > 1 and noise != ExecutionNoise(
            arm_position_std=noise.arm_position_std, arm_angle_std=noise.arm_angle_std
        ):
            raise BadConfig("noise: with more than one environment only the arm's errors can be drawn")

    @property
    def _default_sim_config(self) -> SimConfig:
        return sim_config(self.physics, self._most_hulls * self._n_scenes)

    @property
    def _default_sensor_configs(self) -> list[CameraConfig]:
        return [camera_config(self.overhead, self.region_centre)]

    @property
    def _default_human_render_camera_configs(self) -> CameraConfig:
        x, y = self.region_centre
        pose = sapien_utils.look_at(
            to_world(np.array([x + 0.55, y + 0.5, 0.4])), to_world(np.array([x, y, 0.1]))
        )
        return CameraConfig("render_camera", pose, 512, 512, 0.9, 0.01, 100)

    @property
    def fidelity(self) -> str:
        """Class of the labels made here, "cpu" or "gpu", which must not be mixed in a dataset.

        On a GPU PhysX caches contact points whatever `Physics.persistent_manifold` says and reports no
        separations, so that overlaps of hand and part are not seen; see docs/task.md.
        """
        return "gpu" if self.gpu_sim_enabled else "cpu"

    @property
    def region_centre(self) -> tuple[float, float]:
        """Middle of the region, base frame, metres."""
        x_min, x_max, y_min, y_max = self.region
        return (x_min + x_max) / 2, (y_min + y_max) / 2

    # ------------------------------------------------------------------ scene and episode

    def _load_agent(self, options: dict, *_: Any, **__: Any) -> None:
        super()._load_agent(options, sapien.Pose(p=BASE_IN_WORLD))

    def _load_scene(self, options: dict) -> None:
        names = options.get("parts") or self._part_names
        if names is None:
            names = [str(name) for name in self._batched_episode_rng.choice(list(starter_names()))]
        self.parts = [find_part(names[i % len(names)]) for i in range(self.num_envs)]
        check_tops(self.overhead, self.parts)
        most = max(self.parts, key=lambda part: part.n_hulls)
        if self.gpu_sim_enabled and most.n_hulls > self._most_hulls:
            raise BadConfig(
                f"{most.name} has {most.n_hulls} hulls, this environment's memory is for "
                f"{self._most_hulls}: name the part when the environment is made"
            )
        self._build_table()
        actors = []
        for i, part in enumerate(self.parts):
            actor = add_part(self.scene, part, i)
            self.remove_from_state_dict_registry(actor)
            actors.append(actor)
        self.part = Actor.merge(actors, name="part")
        self.add_to_state_dict_registry(self.part)
        self._hulls = [hull_corners(part) for part in self.parts]
        self._corners = [np.concatenate(own) for own in self._hulls]

    def _build_table(self) -> None:
        builder = self.scene.create_actor_builder()
        half = np.array([0.5, 0.7, 0.02])
        pose = sapien.Pose(p=to_world(np.array([0.45, 0.0, TABLE_Z - half[2]])))
        # PhysX averages both materials, and a part's is without friction.
        mu = 2 * self.physics.friction_table_part if self.gpu_sim_enabled else 0.0
        builder.add_box_collision(pose, half, material=PhysxMaterial(mu, mu, 0.0))
        if self.scene.can_render():
            material = sapien.render.RenderMaterial(base_color=(0.33, 0.35, 0.38, 1.0), roughness=0.9)
            builder.add_box_visual(pose, half, material=material)
        builder.initial_pose = sapien.Pose()
        self._table = builder.build_static(name="table")

    def _after_reconfigure(self, options: dict) -> None:
        self._resting_z = torch.zeros(self.num_envs, device=self.device)
        self._errors: list[ExecutionError | None] = [None] * self.num_envs
        if self.scene.can_render():
            without_reflection_table(self._overhead_sensor)
        for part in self.parts:
            if part.content_hash not in self._standing:
                self._standing[part.content_hash] = standing_poses(part, self.physics)
        self.standing = [self._standing[part.content_hash] for part in self.parts]
        self._friction = self._table_friction()
        self.motion = PandaMotion(self.scene, self.agent, self.physics, self._friction)
        self.contacts = HandContacts(self.scene, self.agent, self.part)
        self.attempt = Attempt(self.agent, self.part, self._hulls, self.motion, self.contacts, self.physics)

    def _table_friction(self) -> TableFriction | None:
        """Friction of the part on the table; PhysX's own on a GPU."""
        if self.gpu_sim_enabled:
            return None
        table = self._table._objs[0].find_component_by_type(PhysxRigidStaticComponent)
        part = self.part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
        return TableFriction(self.scene.px, part, table, self.physics.friction_table_part)

    def _initialize_episode(self, env_idx: Tensor, options: dict) -> None:
        check_reset(options)
        self._outcome = None
        given = options.get("pose_base_obj")
        if given is not None:
            given = poses_of(given, len(env_idx))
        else:
            rows = [
                random_resting_pose(
                    self.standing[i].poses,
                    self.standing[i].probability,
                    self._corners[i],
                    self.region,
                    self._batched_episode_rng[i],
                )
                for i in env_idx.tolist()
            ]
            given = np.stack(rows)
        pose = torch.as_tensor(given, dtype=torch.float32, device=self.device)
        self._resting_z[env_idx] = pose[:, 2]
        self.part.set_pose(ManiSkillPose.create_from_pq(to_world(pose[:, :3]), pose[:, 3:]))
        if self._friction is not None:
            self._friction.reset()
        if len(env_idx) == self.num_envs and self.agent.control_mode == "grasp":
            # This mode's controller sets no targets: the drives would pull towards the last attempt.
            self.motion.place(np.tile(HOME, (self.num_envs, 1)))
        else:
            self.agent.reset(np.tile(self.agent.rest_qpos, (len(env_idx), 1)))
        if self.noise != _EXACT:
            for i in env_idx.tolist():
                self._errors[i] = self.noise.draw(self._batched_episode_rng[i])
            self._apply_error(self._errors[0])

    def begin_episode(self, seed: int, pose_base_obj: np.ndarray | None = None) -> None:
        """Begin the episode of ``reset(seed=seed)`` for `try_grasp`, without its other work.

        A reset takes as long as twenty steps of the simulation. No observation is made, the controllers of
        the other control modes are not reset, nor is torch's generator seeded: nothing here is drawn from it.

        Args:
            seed: Determines the parts' poses and the errors of execution.
            pose_base_obj: (n, 7) poses of the parts, x y z qw qx qy qz; None: drawn at random.
        """
        everywhere = torch.arange(self.num_envs, device=self.device)
        if self.num_envs == 1:  # reseeds the generator: a new one takes half as long as a step
            self._episode_seed = np.array([seed])
            self._batched_episode_rng.rngs[0].seed(seed)
        else:
            self._set_episode_rng(seed, everywhere)
        self._clear_sim_state()
        self._initialize_episode(everywhere, {"pose_base_obj": pose_base_obj})
        if self.gpu_sim_enabled:
            self.scene._gpu_apply_all()
            self.scene.px.gpu_update_articulation_kinematics()
            self.scene._gpu_fetch_all()

    def set_state_dict(self, state: dict, env_idx: Tensor | None = None) -> None:
        """Set the state of `get_state_dict`, which does not include the last step's contacts."""
        super().set_state_dict(state, env_idx)
        self._outcome = None  # of the attempt before, which the state need not come from
        if self._friction is not None:
            self._friction.reset()

    def _apply_error(self, error: ExecutionError | None) -> None:
        """Set gripper force, pad friction and camera pose to those of an attempt, in a single sub-scene."""
        if error is None:
            return
        if error.finger_force is not None:
            self.agent.set_finger_force(error.finger_force)
        if error.friction_pad_part is not None:
            self.agent.set_pad_friction(error.friction_pad_part)
        if self.noise.moves_camera and self.scene.can_render():
            true = error.true_camera(self.T_base_camera)
            self._overhead_sensor.camera._render_cameras[0].set_local_pose(sapien_camera_pose(true))

    def hand_settings(self) -> dict[str, np.ndarray]:
        """Force of each pad, N, and friction of pads and part in the present episode, drawn or as set."""
        error = self._errors[0]
        names = ("finger_force", "friction_pad_part")
        drawn = {name: None if error is None else getattr(error, name) for name in names}
        return {
            name: np.array(getattr(self.physics, name) if value is None else value)
            for name, value in drawn.items()
        }

    # ------------------------------------------------------------------ images and poses

    def capture_depth(self) -> Tensor:
        """(n, h, w) float32 depth in metres from the overhead camera, the robot left out of the picture.

        NaN where the camera sees nothing, such as beyond the table.
        """
        return where_seen(self._render_overhead(with_robot=False)["depth"][..., 0])

    def capture_rgbd(self, *, with_robot: bool = False) -> tuple[Tensor, Tensor]:
        """Colour (n, h, w, 3) uint8 and depth (n, h, w), as of `capture_depth`, from the overhead camera."""
        images = self._render_overhead(rgb=True, with_robot=with_robot)
        return images["rgb"], where_seen(images["depth"][..., 0])

    def _render_overhead(self, *, rgb: bool = False, with_robot: bool) -> dict[str, Tensor]:
        self.agent.show(with_robot)
        try:
            self.scene.update_render(update_sensors=True, update_human_render_cameras=False)
            sensor = self._overhead_sensor
            sensor.capture()
            return sensor.get_obs(rgb=rgb, depth=True, position=False, segmentation=False)
        finally:
            self.agent.show(True)

    @property
    def _overhead_sensor(self) -> Camera:
        sensor = self._sensors["overhead"]
        assert isinstance(sensor, Camera)
        return sensor

    def part_pose(self) -> Pose:
        """``T_base_obj`` of the parts: positions (n, 3), quaternions (n, 4)."""
        return base_pose(self.part)

    def tcp_pose(self) -> Pose:
        """Measured ``T_base_tcp``: positions (n, 3), quaternions (n, 4)."""
        return base_pose(self.agent.tcp)

    # ------------------------------------------------------------------ attempts

    def try_grasp(self, grasp: Tensor) -> dict[str, Tensor]:
        """One whole attempt in every sub-scene; see `tasks.attempt.attempt.Attempt.run`.

        Args:
            grasp: (n, 4) commanded x, y, z, theta, base frame; ``noise`` sets the true target of the hand.
        """
        return self.attempt.run(grasp, self._executed(grasp))

    def _executed(self, grasp: Tensor) -> Tensor:
        if self.noise.arm_position_std == 0 and self.noise.arm_angle_std == 0:
            return grasp
        rows = [np.zeros(4) if error is None else error.grasp for error in self._errors]
        executed = grasp + torch.as_tensor(np.stack(rows), dtype=grasp.dtype, device=grasp.device)
        # Errors of the arm neither press the pads into the table nor lift a command out of it.
        lowest = lowest_grasp_z(TABLE_Z)
        inside = grasp[:, 2] < lowest - 1e-6  # but for rounding
        executed[:, 2] = torch.where(inside, grasp[:, 2], executed[:, 2].clamp(min=lowest))
        return executed

    def _step_action(self, action: Any) -> Any:
        if self.agent.control_mode != "grasp" or action is None:
            self._outcome = None
            return super()._step_action(action)
        grasp = grasps_of(torch.as_tensor(action, dtype=torch.float32, device=self.device), self.num_envs)
        self._outcome = self.try_grasp(grasp)
        return grasp

    def _before_simulation_step(self) -> None:
        # ManiSkill itself steps the scene in the other control modes; in mode grasp `PandaMotion` does.
        if self._friction is not None:
            self._friction.apply()

    # ------------------------------------------------------------------ outcome

    def evaluate(self) -> dict[str, Tensor]:
        """Outcome of the last attempt; in the other control modes, whether the part is held up now."""
        if self._outcome is not None:
            return dict(self._outcome, fail=~self._outcome["success"])
        risen = self.part.pose.p[:, 2] - self._resting_z
        held = torch.as_tensor(self.attempt.grip()[0])
        aloft = risen >= MIN_RISE * self.physics.lift_height
        return dict(success=held & aloft)

    def compute_sparse_reward(self, obs: Any, action: Tensor, info: dict) -> Tensor:
        """S: 1 for a success, 0 otherwise."""
        return info["success"].to(torch.float32)

    def _get_obs_extra(self, info: dict) -> dict[str, Tensor]:
        return dict(tcp_pose=self.tcp_pose().as_vector(), part_pose=self.part_pose().as_vector())
