"""Panel of a dataset."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.grasp import object_displacement, pose_base_tcp
from mskgrasp.dataset import open_dataset
from mskgrasp.view.attempt_list import LIFTED, AttemptList, resting_poses
from mskgrasp.view.dataset_panel import DatasetPanel, comparison_text, shift_text
from mskgrasp.view.motion import Motion
from mskgrasp.view.page import Page
from mskgrasp.view.replay import Replay
from tests.collecting import PARTS
from tests.view.conftest import has_node, node, pose_of, work


@pytest.fixture
def panel(page: Page, collected: Path) -> Iterator[DatasetPanel]:
    one = DatasetPanel(page, open_dataset(collected), PARTS[0])
    work(page)
    yield one
    one.simulator.close()


def test_a_lifted_part_is_drawn_before_and_after_in_the_hand(page: Page, panel: DatasetPanel):
    panel.outcome.value = LIFTED
    work(page)
    columns, number = panel.attempts.columns, int(panel.chosen[0])
    before, after = pose_of(page, "/dataset/attempt/before"), pose_of(page, "/dataset/attempt/after")
    assert pose_distance(before, Pose.from_vector(columns["pose_base_obj"][number].astype(float)))[0] < 1e-6
    tcp = pose_base_tcp(columns["grasp"][number].astype(np.float64)).inverse()
    displacement, _ = object_displacement(tcp @ before, tcp @ after)
    np.testing.assert_allclose(displacement, columns["displacement"][number], atol=1e-5)
    assert f"of {len(panel.attempts)} attempts pass" in panel.text.content
    assert shift_text(columns["displacement"][number]) in panel.text.content


def test_the_buttons_and_the_slider_walk_through_the_attempts_that_pass(page: Page, panel: DatasetPanel):
    def shown() -> np.ndarray:
        return pose_of(page, "/dataset/attempt/before").position

    first = shown()
    panel.next.value = True
    work(page)
    np.testing.assert_allclose(shown(), panel.attempts.columns["pose_base_obj"][1, :3], atol=1e-6)
    panel.previous.value = True
    work(page)
    panel.previous.value = True  # there is none before the first
    work(page)
    np.testing.assert_array_equal(shown(), first)


def test_another_part_brings_its_own_attempts(page: Page, panel: DatasetPanel):
    panel.choice.value = PARTS[1]
    work(page)
    assert panel.attempts.infos[0].part == PARTS[1] and panel.part is not None
    assert panel.part.name == PARTS[1]


def test_the_grasps_at_parts_that_lay_alike_are_drawn_green_and_red_where_they_were_at_the_part(
    page: Page, panel: DatasetPanel
):
    columns = panel.attempts.columns
    failed = int(np.flatnonzero(~columns["success"])[0])
    panel.others.value = True
    panel.number.value = failed
    work(page)
    lines, colours = (getattr(node(page, "/dataset/attempt/others"), name) for name in ("points", "colors"))
    own = columns["grasp"][failed, :3]
    assert np.linalg.norm(lines.mean(axis=1) - own, axis=1).min() < 1e-5
    assert panel.part is not None
    lying = resting_poses(columns["pose_base_obj"][:, 3:], panel.part)
    alike = lying == lying[failed]
    red = colours[:, 0, 0] > colours[:, 0, 1]
    np.testing.assert_array_equal(red, ~columns["success"][alike])


def test_a_filter_that_nothing_passes_draws_nothing(page: Page, panel: DatasetPanel):
    panel.outcome.value = LIFTED
    panel.shift.value = (49.0, 49.5)
    work(page)
    assert not has_node(page, "/dataset/attempt/before") and "none of" in panel.text.content
    panel.again.value = True
    work(page)  # nothing to simulate


def test_an_attempt_is_simulated_again_and_played(page: Page, panel: DatasetPanel):
    panel.simulate()
    assert "as stored" in page.said and has_node(page, "/dataset/motion/part")
    assert not node(page, "/dataset/attempt").visible
    panel.next.value = True
    work(page)
    assert not has_node(page, "/dataset/motion/part") and node(page, "/dataset/attempt").visible
    assert page.said == ""  # it was of the other attempt


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"part_hash": "other"}, "has changed since"), ({"part": "no_such_part"}, "no_such_part")],
)
def test_a_part_that_is_no_longer_what_was_grasped_is_shown_without_its_mesh_and_not_simulated(
    page: Page, collected: Path, monkeypatch, changes: dict[str, str], message: str
):
    found = AttemptList.of(open_dataset(collected), PARTS[0])
    changed = replace(found, infos=tuple(replace(info, **changes) for info in found.infos))
    monkeypatch.setattr(AttemptList, "of", lambda *_: changed)
    panel = DatasetPanel(page, open_dataset(collected))
    work(page)
    page.begin()
    work(page)
    assert message in html.unescape(page.said) and panel.again.disabled
    assert has_node(page, "/dataset/attempt/hand") and not has_node(page, "/dataset/attempt/before")


def test_a_replay_is_compared_with_the_stored_outcome():
    motion = Motion(
        seconds=np.zeros(1), joints=np.zeros((1, 7)), width=np.zeros(1), T_base_obj=Pose.identity()
    )
    lifted = Replay(motion=motion, failure="none", displacement=np.array([0.001, 0.0, 0.0, 0.1]))
    assert "1.00 mm from it" in comparison_text(lifted, "none", np.zeros(4))
    assert "**lifted**, stored as slipped" in comparison_text(lifted, "slipped", np.full(4, np.nan))
    missed = Replay(motion=motion, failure="missed", displacement=np.full(4, np.nan))
    assert comparison_text(missed, "missed", np.full(4, np.nan)).endswith("missed, as stored")
