"""Printed board in the simulated hand."""

from __future__ import annotations

import numpy as np
import sapien

from mskgrasp.core.geometry import Pose

_WHITE = 0.8
"""Reflectance of paper; more would overexpose the image."""


def show_board(entity: sapien.Entity, image: np.ndarray, size: tuple[float, float], pose: Pose) -> None:
    """Attach a flat board, visual only, to an entity; it moves with the entity from now on.

    Args:
        entity: Entity that carries the board.
        image: (h, w) grey levels, uint8.
        size: Width and height, metres.
        pose: Pose of the board in the entity's frame: x right and y down as it is read, z into it.
    """
    x, y = size[0] / 2, size[1] / 2
    vertices = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], dtype=np.float32)
    colour = np.full((*image.shape, 4), 255, dtype=np.uint8)
    colour[..., :3] = np.rint(image[..., None] * _WHITE)
    # Flat, not glossy, and with smaller copies, so that a square far away does not flicker.
    material = sapien.render.RenderMaterial(base_color=[1.0, 1.0, 1.0, 1.0], roughness=1.0, specular=0.0)
    material.base_color_texture = sapien.render.RenderTexture2D(
        colour, "R8G8B8A8Unorm", mipmap_levels=_levels(image.shape), address_mode="edge"
    )
    shape = sapien.render.RenderShapeTriangleMesh(
        vertices=vertices,
        # Counter-clockwise as seen from the printed side, which looks along -z.
        triangles=np.array([[0, 2, 1], [0, 3, 2]], dtype=np.uint32),
        normals=np.tile(np.array([[0, 0, -1]], dtype=np.float32), (4, 1)),
        uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32),
        material=material,
    )
    shape.local_pose = sapien.Pose(pose.as_matrix().astype(np.float32))
    body = sapien.render.RenderBodyComponent()
    body.attach(shape)
    entity.add_component(body)


def _levels(shape: tuple[int, ...]) -> int:
    return int(np.log2(min(shape[:2])))
