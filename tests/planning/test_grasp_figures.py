"""Figures of grasps from above."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from matplotlib import colors

from mskgrasp.core.palette import GREEN, RED
from mskgrasp.planning.grasp_figures import draw_contact_sheet
from tests import synthetic


def share_of(colour: str, picture: np.ndarray) -> float:
    """Share of the pixels, BGR, that have nearly a colour."""
    wanted = 255 * np.array(colors.to_rgb(colour))[::-1]
    return float((np.abs(picture - wanted).max(axis=2) < 20).mean())


def test_a_contact_sheet_shows_held_and_failed_attempts(tmp_path: Path):
    attempts = synthetic.random_attempts(8, (0.05, 0.02, 0.03), np.random.default_rng(3))
    assert 0 < attempts.success.sum() < 8
    shown = {}
    for held in (True, False):
        path = tmp_path / f"{held}.png"
        rows = np.flatnonzero(attempts.success == held)
        draw_contact_sheet([(attempts, synthetic.info("box"), int(row)) for row in rows], path, title="Boxes")
        picture = cv2.imread(str(path))
        assert picture is not None
        shown[held] = [share_of(colour, picture) for colour in (GREEN, RED)]
    # The words over a held part are green, those over a failure red.
    assert shown[True][0] > 5e-3 > shown[True][1] and shown[False][1] > 5e-3 > shown[False][0]
