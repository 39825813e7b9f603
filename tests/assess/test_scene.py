"""Part and hand in 3-D: a page by itself, whose geometry is where the grasp puts it."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest
import trimesh

from mskgrasp.assess.scene import scene_page
from mskgrasp.core.grasp import MAX_OPENING
from tests.planning.test_certified import PART, certified, certified_grasp


def shown(page: str) -> trimesh.Scene:
    """The scene that a page holds."""
    found = re.search(r'base64_data="([A-Za-z0-9+/=]+)"', page)
    assert found is not None
    return trimesh.load_scene(trimesh.util.wrap_as_stream(base64.b64decode(found[1])), file_type="glb")


def meshes(scene: trimesh.Scene) -> tuple[list[trimesh.Trimesh], list[trimesh.Trimesh]]:
    """The parts, and the boxes of the hand, where they stand."""
    placed = [
        scene.geometry[name].copy().apply_transform(matrix)
        for matrix, name in map(scene.graph.get, scene.graph.nodes_geometry)
    ]
    boxes = [mesh for mesh in placed if len(mesh.faces) == 12]
    return [mesh for mesh in placed if len(mesh.faces) != 12], boxes


def test_each_resting_pose_is_shown_with_the_hand_of_its_best_grasp_and_the_moved_part():
    still = certified_grasp(mean=np.zeros(4), grasp=np.array([0.0, 0.0, 0.0105, 0.0]))
    parts, boxes = meshes(shown(scene_page(PART, certified(still, like={}), [0])))
    assert (len(parts), len(boxes)) == (2, 3)  # the part twice; two fingers and a palm
    assert parts[0].extents == pytest.approx(parts[1].extents, abs=1e-5)
    assert parts[0].centroid == pytest.approx(parts[1].centroid, abs=1e-5)  # it does not move
    apart = [np.linalg.norm(one.centroid - other.centroid) for one in boxes for other in boxes]
    assert max(apart) == pytest.approx(MAX_OPENING + 0.008, abs=1e-5)


def test_the_moved_part_is_where_it_is_expected():
    moved = certified_grasp(mean=np.array([0.003, 0.004, 0.0, 0.0]), grasp=np.array([0.0, 0.0, 0.0105, 0.5]))
    parts, _ = meshes(shown(scene_page(PART, certified(moved, like={}), [0])))
    assert np.linalg.norm(parts[0].centroid - parts[1].centroid) == pytest.approx(0.005, abs=1e-5)


def test_poses_without_a_grasp_are_shown_alone():
    parts, boxes = meshes(shown(scene_page(PART, certified(like={}), [0, 1])))
    assert (len(parts), len(boxes)) == (2, 0)


def test_poses_stand_in_rows_of_three_the_second_row_in_front():
    parts, _ = meshes(shown(scene_page(PART, certified(like={}), [0, 1, 2, 0])))
    # The viewer's up is y, and z comes towards the eye.
    *behind, front = sorted((one.centroid for one in parts), key=lambda centroid: centroid[2])
    first, second, third = sorted(behind, key=lambda centroid: centroid[0])
    step = second[0] - first[0]
    assert step > max(PART.extents) and third[0] - first[0] == pytest.approx(2 * step, rel=0.2)
    assert front[:2] == pytest.approx(first[:2], abs=1e-5)
    assert front[2] - first[2] > max(PART.extents)
