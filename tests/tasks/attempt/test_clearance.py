"""Clearance of the hand computed from hulls, and the same outcome without simulating the air."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tasks.attempt.clearance import hand_clearance

FIELDS = ("success", "failure", "displacement", "tilt")


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> np.ndarray:
    """Corners (8, 3) in the grasp frame, from millimetres."""
    return np.array(list(itertools.product(x, y, z))) * 1e-3


@pytest.mark.parametrize(
    ("corners", "free", "reach"),
    [
        (box((-20, 20), (-10, 12), (-9, 5)), True, 12),  # between the pads, not in the middle
        (box((-20, 20), (-10, 39), (-9, 5)), False, 0),  # nearer to a finger than the margin
        (box((-20, 20), (-10, 45), (-9, 5)), False, 0),  # under a finger
        (box((-20, 20), (-10, 45), (-30, -12)), True, 0),  # the same, but below the fingers' tips
        (box((-20, 20), (-80, 80), (-9, 5)), False, 0),  # under both
        (box((-20, 20), (70, 90), (-9, 5)), True, 0),  # beyond the back of a finger
        (box((14, 40), (-50, 50), (-9, 5)), True, 0),  # beside the hand
        (box((-20, 20), (-10, 12), (-9, 36)), False, 0),  # up to the palm
    ],
)
def test_a_box_is_free_of_the_hand_where_paper_says_so(corners, free, reach):
    found = hand_clearance([corners])
    assert found.free == free
    assert found.reach == pytest.approx(reach * 1e-3)


def test_a_slanting_bar_counts_only_where_it_crosses_the_pads():
    # From (-50, -50) to (50, 50) mm, 4 mm wide: under |x| <= 13 mm it reaches to 13 mm and half its width.
    along, across = np.array([1, 1]) / np.sqrt(2), np.array([-1, 1]) / np.sqrt(2)
    outline = [70.7 * a * along + 2 * b * across for a in (-1, 1) for b in (-1, 1)]
    corners = np.array([[*point, z] for point in outline for z in (-9, 5)]) * 1e-3
    found = hand_clearance([corners])
    assert found.free
    assert found.reach == pytest.approx(1e-3 * (13 + 2 * np.sqrt(2)), abs=1e-5)


def test_of_several_hulls_the_farthest_counts_and_the_worst_decides():
    near, far = box((-5, 5), (0, 8), (-9, 0)), box((-5, 5), (-25, -20), (-9, 0))
    assert hand_clearance([near, far]).reach == pytest.approx(0.025)
    assert not hand_clearance([near, box((-5, 5), (41, 43), (-9, 0))]).free


@pytest.mark.parametrize(
    "at",
    [
        (0.5, 0.0),
        (0.506, 0.02),
        (0.5, 0.042),
        *(pytest.param(at, marks=pytest.mark.slow) for at in [(0.503, 0.006), (0.5, -0.012), (0.5, 0.1)]),
    ],
)
def test_skipping_the_air_changes_nothing_but_the_time(env, attempt, monkeypatch, at):
    turn, grasp = 0.15, (0.5, 0.0, 0.02, 0.0)
    quick = attempt(grasp, at=at, turn=turn)
    monkeypatch.setattr(env, "physics", env.physics.model_copy(update={"skip_air": False}))
    whole = attempt(grasp, at=at, turn=turn)
    assert bool(quick["success"]) == bool(whole["success"]) and int(quick["failure"]) == int(whole["failure"])
    assert float(quick["seconds"]) <= float(whole["seconds"])
    if quick["success"]:
        assert quick["seconds"] < whole["seconds"] - 0.2
        difference = (quick["displacement"] - whole["displacement"]).abs()
        assert difference[:3].max() < 1e-4 and difference[3] < 2e-3
