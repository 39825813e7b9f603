"""Simulated bodies with the shape, mass and inertia of a part's mesh."""

from __future__ import annotations

import numpy as np
import sapien
import trimesh
from mani_skill.envs.scene import ManiSkillScene
from mani_skill.utils.structs.actor import Actor
from sapien.physx import PhysxMaterial, PhysxRigidDynamicComponent
from scipy.spatial import ConvexHull

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import Part

LEAST_KEPT = 2e-3
"""Share of the hulls' volume that cooking may lose: corners that protrude very little are dropped."""

STEEL_GREY = (0.55, 0.57, 0.6, 1.0)


def add_part(scene: ManiSkillScene, part: Part, scene_index: int, friction: float = 0.0) -> Actor:
    """Load a part into one sub-scene.

    Args:
        scene: All sub-scenes.
        part: The part, read from its folder.
        scene_index: Index of the sub-scene.
        friction: Coefficient of its material; the effective one is the mean with the other body's.

    Raises:
        BadPart: PhysX could not cook every hull of the part.
    """
    builder = scene.create_actor_builder()
    add_hulls(builder, part, friction)
    if scene.can_render():
        builder._procedural_shapes.append(_visual(part))
    builder.initial_pose = sapien.Pose(p=[0, 0, 0.5 + 0.5 * part.longest_axis])
    builder.set_scene_idxs([scene_index])
    actor = builder.build(name=f"{part.name}-{scene_index}")
    body = actor._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    _check_cooked(part, body)
    return actor


def add_hulls(builder: sapien.ActorBuilder, part: Part, friction: float = 0.0) -> None:
    """Give a body the part's hulls, mass and inertia.

    The hulls are stored in millimetres and scaled, because PhysX drops hull vertices that lie closer
    than 0.7 of its length unit's thousandth; mass and inertia come from the mesh, because PhysX would
    add up overlapping hulls and clamp small inertias.
    """
    material = PhysxMaterial(friction, friction, 0.0)
    builder.add_multiple_convex_collisions_from_file(
        str(part.hulls_path), scale=[1e-3] * 3, material=material
    )
    builder.set_mass_and_inertia(
        part.mass, sapien.Pose(q=part.quat_obj_principal), part.principal_inertia.astype(np.float32)
    )


def _check_cooked(part: Part, body: PhysxRigidDynamicComponent | None) -> None:
    """Refuse a body that differs from the part: PhysX silently drops hulls and corners, and clamps."""
    shapes = body.collision_shapes if body is not None else []
    volume = sum(ConvexHull(shape.vertices * shape.scale).volume for shape in shapes)
    if len(shapes) != part.n_hulls or not np.isclose(volume, part.hulls_volume, rtol=LEAST_KEPT):
        raise BadPart(
            f"part '{part.name}': PhysX took {len(shapes)} of {part.n_hulls} hulls and "
            f"{volume / part.hulls_volume:.2%} of their volume; delete {part.folder} and make it again"
        )
    if body is not None and not (
        np.isclose(body.mass, part.mass, rtol=1e-4)
        and np.allclose(body.inertia, part.principal_inertia, rtol=1e-3)
    ):
        raise BadPart(
            f"part '{part.name}': PhysX took a mass of {body.mass:.4g} kg and an inertia of {body.inertia} "
            f"instead of {part.mass:.4g} kg and {part.principal_inertia}; use a part that is less extreme"
        )


def _visual(part: Part) -> sapien.render.RenderShapeTriangleMesh:
    """The mesh with flat shading.

    From arrays: SAPIEN 3.0.3 crashes the process when it is given a PLY file together with a material.
    """
    mesh = trimesh.load_mesh(part.mesh_path)
    vertices = np.asarray(mesh.triangles, dtype=np.float32).reshape(-1, 3)
    return sapien.render.RenderShapeTriangleMesh(
        vertices=vertices,
        triangles=np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3),
        normals=np.repeat(np.asarray(mesh.face_normals, dtype=np.float32), 3, axis=0),
        uvs=np.zeros((len(vertices), 2), dtype=np.float32),
        material=sapien.render.RenderMaterial(base_color=STEEL_GREY, metallic=0.3, roughness=0.5),
    )
