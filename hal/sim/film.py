"""Film of a grasp in the simulated cell: the cell from the side, and the fingers from above."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import sapien
from mani_skill.sensors.camera import Camera, CameraConfig
from mani_skill.utils import sapien_utils
from mani_skill.utils.structs.pose import Pose as ManiSkillPose

from hal.sim.world import SapienWorld
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from tasks.robot.panda import FINGER_LINKS
from tasks.scene.camera import FLOAT_DEPTH, without_reflection_table
from tasks.scene.frames import sapien_camera_pose, to_world

EDGE = 0.12
"""Edge of the square of the grasp frame that the view from above shows, metres: the open fingers fit in."""
FRAME_S = 0.12
"""Time between two pictures while the fingers stand still, s."""
GAP_STEP = 1e-3
"""Change of the distance of the pads, metres, after which there is a picture earlier."""
_ABOVE = 0.3
"""Height of the upper camera over the hand, metres."""


@dataclass(frozen=True, kw_only=True)
class View:
    """A rendered picture.

    Attributes:
        colour: (n, n, 3) uint8, RGB.
        part: (n, n) bool, pixels of the part.
        fingers: (n, n) bool, pixels of the fingers.
        empty: (n, n) bool, pixels of nothing.
    """

    colour: np.ndarray
    part: np.ndarray
    fingers: np.ndarray
    empty: np.ndarray


@dataclass(frozen=True, kw_only=True)
class FilmFrame:
    """One moment of a film.

    Attributes:
        seconds: Simulated time since the film began.
        side: The cell from the side.
        above: Part and fingers from above, without the hand and without perspective: the square of `EDGE`
            metres around the grasp's origin, the grasp frame's x to the right and its y up.
        T_base_tcp: Measured pose of the hand.
        T_base_obj: True pose of the part.
    """

    seconds: float
    side: View
    above: View
    T_base_tcp: Pose
    T_base_obj: Pose


class Film:
    """Pictures of a grasp on a simulated cell; nothing that is simulated depends on them.

    Args:
        world: World of the connected cell, after the part was presented.
        grasp: A single one, base frame.
        n_pixels: Pixels along the edge of each picture.
    """

    def __init__(self, world: SapienWorld, grasp: Grasp, n_pixels: int = 400):
        self._world = world
        agent = world.env.agent
        x, y, z = grasp.position
        eye, target = np.array([x + 0.24, y + 0.19, z + 0.13]), np.array([x, y, z + 0.03])
        self._side = self._camera("side", sapien_utils.look_at(to_world(eye), to_world(target)), n_pixels)
        # The TCP's axes are those of a camera that looks down: x to the right, y down in the picture.
        down = grasp.raised(_ABOVE).T_base_tcp
        self._above = self._camera("above", ManiSkillPose.create(sapien_camera_pose(down)), n_pixels)
        for one in self._above.camera._render_cameras:
            one.set_orthographic_parameters(0.01, 10.0, EDGE / 2)
        fingers = [link for link in agent.robot.links if link.name in FINGER_LINKS]
        self._finger_bodies = [_body(link._objs[0].entity) for link in fingers]
        self._fingers = [int(link.per_scene_id[0]) for link in fingers]
        self._part = int(world.env.part.per_scene_id[0])

    def _camera(self, name: str, pose: ManiSkillPose, n_pixels: int) -> Camera:
        config = CameraConfig(
            f"film_{name}", pose, n_pixels, n_pixels, 0.85, 0.01, 10.0, shader_config=FLOAT_DEPTH
        )
        camera = Camera(config, self._world.env.scene)
        without_reflection_table(camera)
        return camera

    @contextmanager
    def recorded(self) -> Iterator[list[FilmFrame]]:
        """Take pictures while the arm moves in the block; the list grows meanwhile."""
        motion = self._world.env.motion
        before, began = motion.watch, motion.seconds
        frames = [self._take(0.0)]
        gap = float(motion.gap()[0])

        def look(seconds: float) -> None:
            nonlocal gap
            if before is not None:
                before(seconds)
            now = float(motion.gap()[0])
            if seconds - began - frames[-1].seconds >= FRAME_S or abs(now - gap) > GAP_STEP:
                frames.append(self._take(seconds - began))
                gap = now

        motion.watch = look
        try:
            yield frames
        finally:
            motion.watch = before
        frames.append(self._take(motion.seconds - began))

    def _take(self, seconds: float) -> FilmFrame:
        env = self._world.env
        side = self._view(self._side)
        env.agent.show(False)
        for body in self._finger_bodies:
            body.visibility = 1.0
        try:
            above = self._view(self._above)
        finally:
            env.agent.show(True)
        tcp = env.tcp_pose()
        return FilmFrame(
            seconds=seconds,
            side=side,
            above=above,
            T_base_tcp=Pose(
                position=tcp.position[0].cpu().numpy().astype(np.float64),
                quat_wxyz=tcp.quat_wxyz[0].cpu().numpy().astype(np.float64),
            ),
            T_base_obj=self._world.part_pose(),
        )

    def _view(self, camera: Camera) -> View:
        self._world.env.scene.update_render(update_sensors=True, update_human_render_cameras=False)
        camera.capture()
        images = camera.get_obs(rgb=True, depth=False, position=False, segmentation=True)
        bodies = images["segmentation"][0, ..., 0].cpu().numpy()
        return View(
            colour=images["rgb"][0].cpu().numpy(),
            part=bodies == self._part,
            fingers=np.isin(bodies, self._fingers),
            empty=bodies == 0,
        )


def _body(entity: sapien.Entity) -> sapien.render.RenderBodyComponent:
    found = entity.find_component_by_type(sapien.render.RenderBodyComponent)
    assert isinstance(found, sapien.render.RenderBodyComponent)
    return found
