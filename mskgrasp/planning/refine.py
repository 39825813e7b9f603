"""Refinements of the planner's search: collision check of the fingers, and grasps where the part is held.

Grasps are arrays (n, 4), x y z theta in the base frame, as in `mskgrasp.planning.scoring`.
"""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import (
    FINGER_HALF_WIDTH,
    FINGER_THICKNESS,
    MAX_OPENING,
    PAD_REACH,
)
from mskgrasp.planning.scoring import Scene

_STEP = 0.002


def hand_room(scene: Scene, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Check where open hands have room, and something to close on.

    A pixel higher than the finger tips within a finger's footprint collides. Invalid pixels count as table.

    Args:
        scene: The part and what lies around it.
        grasps: (n, 4) base frame.

    Returns:
        Whether the open fingers are free of collisions (n,), and whether something is between the pads (n,).
    """
    reach = MAX_OPENING / 2 + FINGER_THICKNESS
    rows, columns = 2 * int(np.ceil(reach / _STEP)) + 1, 2 * int(np.ceil(FINGER_HALF_WIDTH / _STEP)) + 1
    along = np.abs((np.arange(rows) - (rows - 1) / 2) * _STEP)
    fingers = (along >= MAX_OPENING / 2) & (along <= reach)
    heights = scene.crop_of(grasps, (rows, columns), _STEP)[:, 0].amax(dim=2).cpu().double().numpy()
    tips = grasps[:, 2] - scene.table_z - PAD_REACH
    return heights[:, fingers].max(axis=1) <= tips, heights[:, along < MAX_OPENING / 2].max(axis=1) > tips


def where_held(grasps: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Move grasps (n, 4) to where the hand would be to the part once it holds it, at the same height.

    Args:
        grasps: (n, 4).
        displacement: (n, k) their predicted grasp displacements.
    """
    moved = grasps.copy()
    cos, sin = np.cos(grasps[:, 3]), np.sin(grasps[:, 3])
    x, y = displacement[:, 0], displacement[:, 1]
    moved[:, 0] += cos * x - sin * y
    moved[:, 1] += sin * x + cos * y
    moved[:, 3] = wrap_half_turn(grasps[:, 3] + displacement[:, 3])
    return moved
