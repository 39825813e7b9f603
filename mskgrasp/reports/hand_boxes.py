"""Outline of the hand as boxes, for pictures in 3-D."""

from __future__ import annotations

import trimesh

from mskgrasp.core.grasp import FINGER_HALF_WIDTH, MAX_OPENING, PAD_REACH, PALM_HEIGHT


def hand_boxes(width: float = MAX_OPENING) -> list[trimesh.Trimesh]:
    """Both fingers and the palm in the grasp frame, which has z up, metres.

    Args:
        width: Distance between the pads, metres.

    Returns:
        The finger at negative y, that at positive y, and the palm.
    """
    boxes = []
    for side in (-1, 1):
        finger = trimesh.creation.box([2 * FINGER_HALF_WIDTH, 0.008, PALM_HEIGHT + PAD_REACH])
        finger.apply_translation([0.0, side * (width / 2 + 0.004), (PALM_HEIGHT - PAD_REACH) / 2])
        boxes.append(finger)
    palm = trimesh.creation.box([2 * FINGER_HALF_WIDTH, MAX_OPENING + 0.03, 0.02])
    palm.apply_translation([0.0, 0.0, PALM_HEIGHT + 0.01])
    return [*boxes, palm]
