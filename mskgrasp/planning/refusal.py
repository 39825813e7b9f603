"""Reason why no grasp of a part is worth trying, from its depth image."""

from __future__ import annotations

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH
from mskgrasp.perception.footprint import narrowest_width
from mskgrasp.perception.part_detection import find_part_pixels
from mskgrasp.planning.refine import hand_room
from mskgrasp.planning.scoring import Scene

CORNERS = 0.15
"""Share of the candidates below which the hand fits over corners at most: on a square of 85 mm over 9 %, on a
frame of 12 mm bars over 31 %."""


def refusal_reason(
    frame: RgbdFrame,
    scene: Scene,
    candidates: np.ndarray,
    bound: float,
    *,
    region: tuple[float, float, float, float],
    min_height: float,
    part_height: float,
) -> str:
    """State why the predicted qualities are low, as far as the image shows it.

    Args:
        frame: Frame of the part.
        scene: The same with the part as detected.
        candidates: (n, 4) grasps of low predicted quality, base frame.
        bound: Lowest predicted quality of a grasp that is tried.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        min_height: Least height of a part above the table, metres.
        part_height: As of `mskgrasp.perception.part_detection.find_part_pixels`.

    Returns:
        A clause with its remedy; where the image shows no reason, that the model predicts no better.
    """
    free, between = hand_room(scene, candidates)
    fits = float((free & between).mean())
    if fits < CORNERS:
        found = find_part_pixels(
            frame.depth, frame.intrinsics, frame.T_base_camera,
            table_z=scene.table_z, region=region, min_height=min_height, part_height=part_height,
        )  # fmt: skip
        width = narrowest_width(found.points_base[:2, found.mask].T)
        if width > MAX_OPENING:
            return (
                f"the part is wider than the hand opens ({width * 1e3:.0f} mm at its narrowest, "
                f"{MAX_OPENING * 1e3:g} mm); leave it out, or place it on a narrower side"
            )
    if not fits:
        lowest = float(candidates[:, 2].min()) - PAD_REACH - scene.table_z
        if not between.any() and scene.view.size[2] <= lowest:
            return (
                f"the part is {scene.view.size[2] * 1e3:.1f} mm high, and the fingers stay "
                f"{lowest * 1e3:.1f} mm over the table; place it on a higher side"
            )
        return (
            "something is in the way of the open fingers wherever they would close on the part; clear the "
            "table around it, or place it another way"
        )
    return (
        f"the model predicts less than planner.min_quality {bound:g} for every grasp; place the part another "
        "way, or lower the bound"
    )
