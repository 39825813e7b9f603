"""Part, certified grasps and expected shift in 3-D, as a page that needs no network."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from trimesh.viewer.notebook import scene_to_html
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from mskgrasp.assess.figures import COLUMNS
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.core.grasp import (
    pose_base_grasp,
    to_grasp_displacement,
)
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasp, CertifiedGrasps
from mskgrasp.reports.hand_boxes import hand_boxes

MOST_FACES = 20_000
"""A finer mesh is shown with its collision hulls instead, so that a report stays small enough to send."""
_PART, _HAND, _GHOST = (160, 165, 175, 255), (31, 111, 235, 255), (232, 89, 12, 90)


def scene_page(part: Part, certified: CertifiedGrasps, poses: Sequence[int]) -> str:
    """A page with resting poses in rows of three, each with the hand of its best grasp.

    A translucent part shows where it is expected to lie relative to the hand once the fingers have closed.

    Args:
        part: The part.
        certified: Its certified grasps.
        poses: Numbers of the resting poses, from left to right, the last row in front.
    """
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    if len(mesh.faces) > MOST_FACES:
        mesh = trimesh.load_scene(part.hulls_path).to_mesh().apply_scale(1e-3)
    scene = trimesh.Scene()
    # A grasp is on the part, so that no hand reaches that of the next pose.
    step = float(np.linalg.norm(part.extents)) + _hand_width()
    for place, number in enumerate(poses):
        row, column = divmod(place, COLUMNS)
        aside = np.array([column * step, -row * step, 0.0])
        at = Pose.translation(aside)
        lying = at @ part.resting[number]
        scene.add_geometry(_painted(mesh, _PART), transform=lying.as_matrix())
        grasps, _ = certified.of(number)
        if grasps:
            hand = at @ pose_base_grasp(grasps[0].grasp)
            for box in hand_boxes():
                scene.add_geometry(_painted(box, _HAND), transform=hand.as_matrix())
            moved = hand @ _motion(grasps[0], hand.inverse() @ lying) @ (hand.inverse() @ lying)
            scene.add_geometry(_painted(mesh, _GHOST), transform=moved.as_matrix())
    # The viewer's up is y.
    upright = trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    scene.apply_transform(upright)
    scene.set_camera(angles=(-0.8, 0.2, 0.0), distance=0.92 * scene.scale, center=scene.centroid)
    return scene_to_html(scene)


def _hand_width() -> float:
    return float(max(np.ptp([box.bounds for box in hand_boxes()], axis=(0, 1))))


def _motion(grasp: CertifiedGrasp, lying: Pose) -> Pose:
    """Motion of the part in the grasp frame that displaces its origin as expected."""
    origin = np.asarray(lying.position)
    motion = to_grasp_displacement(grasp.mean, origin)
    # The hand moves by it in the part's frame: the part moves by the inverse.
    return Pose(position=motion[:3], quat_wxyz=quat_about_z(np.asarray(motion[3]))).inverse()


def _painted(mesh: trimesh.Trimesh, colour: tuple[int, int, int, int]) -> trimesh.Trimesh:
    painted = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    red, green, blue, alpha = (value / 255 for value in colour)
    material = PBRMaterial(
        baseColorFactor=[red, green, blue, alpha],
        metallicFactor=0.1,
        roughnessFactor=0.7,
        alphaMode="BLEND" if alpha < 1 else "OPAQUE",
        doubleSided=True,
    )
    painted.visual = TextureVisuals(material=material)
    return painted
