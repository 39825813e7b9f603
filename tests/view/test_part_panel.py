"""Panel of a part."""

from __future__ import annotations

import html

import numpy as np
import pytest

from mskgrasp.core.settings import TABLE_Z
from mskgrasp.parts import find_part
from mskgrasp.view.page import Page
from mskgrasp.view.part_panel import ALL, PartPanel, part_text, pose_text, side_by_side
from tests.view.conftest import has_node, node, pose_of, work

PART = find_part("hex_nut_m30")


def test_a_part_lies_on_the_table_in_each_of_its_resting_poses(page: Page):
    panel = PartPanel(page, PART)
    panel.shown()
    for number in range(len(PART.resting_probability)):
        panel.pose.value = pose_text(PART, number)
        work(page)
        shown = [i for i in range(len(PART.resting_probability)) if has_node(page, f"/part/poses/{i}")]
        assert shown == [number]
        vertices = np.asarray(node(page, f"/part/poses/{number}/mesh").vertices, dtype=np.float64)
        lowest = pose_of(page, f"/part/poses/{number}").apply(vertices)[:, 2].min()
        assert lowest == pytest.approx(TABLE_Z, abs=1e-4)


def test_all_poses_lie_side_by_side_without_touching(page: Page):
    panel = PartPanel(page, PART)
    panel.pose.value = ALL
    work(page)
    assert all(has_node(page, f"/part/poses/{i}/mesh") for i in range(len(PART.resting_probability)))
    poses = side_by_side(PART, [0, 1, 2])
    apart = np.diff([pose.position[1] for pose in poses])
    assert (apart > np.linalg.norm(PART.extents)).all()


def test_hulls_are_drawn_in_the_translucent_mesh_or_alone(page: Page):
    panel = PartPanel(page, PART)
    number = int(np.argmax(PART.resting_probability))
    panel.hulls.value = True
    work(page)
    assert has_node(page, f"/part/poses/{number}/hulls/0")
    assert node(page, f"/part/poses/{number}/mesh").opacity < 1
    panel.mesh.value = False
    work(page)
    assert not has_node(page, f"/part/poses/{number}/mesh")


def test_the_text_gives_size_and_mass():
    text = html.unescape(part_text(PART))
    assert f"{1e3 * PART.mass:.1f} g" in text and "46.0" in text and PART.name in text
