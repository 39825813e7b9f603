"""Animation of a grasp: the cell, and beside it the part as it shifts between the fingers."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from hal.sim import EDGE, FilmFrame, View
from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import object_displacement
from mskgrasp.core.palette import BLUE, GREEN, INK, ORANGE, PALE, SLATE
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import displacement_of_point

_PANEL = 320
"""Pixels along the edge of each picture."""
_HEAD, _FOOT, _MARGIN, _GAP = 26, 68, 8, 8
"""Pixels over, under and beside the pictures, and between them."""
_FRAME_MS, _LAST_MS = 90, 2500
"""Time for which a picture is shown, and the last one."""
_COLOURS = 64
"""Colours of the palette, which all pictures share so that nothing flickers."""
_LEVEL = 2.0
"""Turns from full brightness: the part's grey becomes a blue that is neither black nor white."""


def write_animation(frames: Sequence[FilmFrame], plan: GraspPlan, path: Path) -> np.ndarray:
    """Write the film of a planned grasp as an animated GIF.

    Drawn over it: the part's outline before the grasp, the outline expected in the hand, and in numbers the
    shift of the part's seen centre so far.

    Args:
        frames: The film, from before the grasp to the lifted part.
        plan: The plan.
        path: The file.

    Returns:
        (4,) the displacement of the seen centre in the last frame, grasp frame, metres and radians.
    """
    outlines = _outlines(frames[0].above.part, plan)
    moved = [_displacement(frame, frames[0], plan) for frame in frames]
    pictures = [_picture(frame, plan, outlines, now) for frame, now in zip(frames, moved, strict=True)]
    sample = np.vstack([np.asarray(pictures[k]) for k in (0, len(pictures) // 2, -1)])
    palette = Image.fromarray(sample).quantize(_COLOURS, dither=Image.Dither.NONE)
    first, *others = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    times = [_FRAME_MS] * len(others) + [_LAST_MS]
    gif = io.BytesIO()
    first.save(gif, format="gif", save_all=True, append_images=others, duration=times, loop=0, optimize=True)
    write_whole(path, gif.getvalue())
    return moved[-1]


def _displacement(now: FilmFrame, before: FilmFrame, plan: GraspPlan) -> np.ndarray:
    """(4,) displacement of the seen centre once the hand is at the grasp; zero until then."""
    grasp = plan.grasp
    if now.T_base_tcp.position[2] > grasp.position[2] + 1e-3 and now.T_base_obj.position[2] < (
        before.T_base_obj.position[2] + 1e-3
    ):
        return np.zeros(4)  # the hand is on its way to a part that lies
    moved, _ = object_displacement(
        grasp.T_base_tcp.inverse() @ before.T_base_obj, now.T_base_tcp.inverse() @ now.T_base_obj
    )
    origin, centre = (
        grasp.T_base_grasp.inverse().apply(point)
        for point in (before.T_base_obj.position, plan.view.centre_base)
    )
    return displacement_of_point(np.asarray(moved), origin, centre)


def _outlines(part: np.ndarray, plan: GraspPlan) -> list[tuple[str, list[np.ndarray]]]:
    """Colour and polygons (k, 2), in pixels, of the part's outline before, and as expected."""
    n = len(part)
    scale = EDGE / n
    found, _ = cv2.findContours(part.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    smooth = [cv2.approxPolyDP(one, 1.0, True)[:, 0] for one in found]  # without the stairs of the pixels
    metres = [(one - (n - 1) / 2) * (scale, -scale) for one in smooth]
    centre = plan.grasp.T_base_grasp.inverse().apply(plan.view.centre_base)[:2]
    dx, dy, _, turn = plan.displacement
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    expected = [(one - centre) @ rotation.T + centre + (dx, dy) for one in metres]
    pixel = _PANEL / EDGE
    return [
        (colour, [one * (pixel, -pixel) + (_PANEL - 1) / 2 for one in polygons])
        for colour, polygons in ((INK, metres), (ORANGE, expected))
    ]


def _picture(
    frame: FilmFrame, plan: GraspPlan, outlines: list[tuple[str, list[np.ndarray]]], moved: np.ndarray
) -> Image.Image:
    size = (2 * _PANEL + 2 * _MARGIN + _GAP, _HEAD + _PANEL + _FOOT)
    picture = Image.new("RGB", size, "white")
    left, right = (_MARGIN, _HEAD), (_MARGIN + _PANEL + _GAP, _HEAD)
    picture.paste(_painted(frame.side), left)
    above = _painted(frame.above)
    lines = ImageDraw.Draw(above)
    for colour, polygons in outlines:
        for one in polygons:
            lines.line([tuple(point) for point in (*one, one[0])], fill=colour, width=2)
    picture.paste(above, right)
    draw = ImageDraw.Draw(picture)
    font, bold = ImageFont.load_default(14), ImageFont.load_default(15)
    draw.text((left[0], 5), "The cell", INK, bold)
    draw.text((right[0], 5), "Part and fingers from above", INK, bold)
    std = plan.displacement_std
    y = _HEAD + _PANEL + 6
    rows = (
        (INK, "outline", "before the grasp", ""),
        (ORANGE, "outline", "expected", _text(plan.displacement, std)),
        (GREEN, "", "so far", _text(moved)),
    )
    for k, (colour, mark, name, text) in enumerate(rows):
        draw.text((left[0], y + 19 * k), f"{mark} {name}".strip(), colour, font)
        draw.text((left[0] + 190, y + 19 * k), text, colour, font)
    draw.text((left[0] + 190, y), "shift of the part's centre in the hand:", SLATE, font)
    return picture


def _text(moved: np.ndarray, std: np.ndarray | None = None) -> str:
    spread = [""] * 4
    if std is not None and np.isfinite(std).all():
        spread = [f" ± {1e3 * one:.1f}" for one in std[:3]] + [f" ± {np.degrees(std[3]):.0f}"]
    shifts = [f"{name} {1e3 * moved[k]:+z.1f}{spread[k]}" for k, name in enumerate("xy")]
    return f"{',  '.join(shifts)} mm,  turn {np.degrees(moved[3]):+z.0f}{spread[3]}°"


def _painted(view: View) -> Image.Image:
    """The picture with a blue part, light surroundings and no black sky."""
    colour = view.colour.astype(np.float64)
    light = 0.45 * colour + 0.55 * 255
    brightness = colour.mean(axis=-1, keepdims=True) / 255
    part = np.clip(_LEVEL * brightness * _rgb(BLUE) / 1.3, 0, 255)
    light = np.where(view.fingers[..., None], 0.6 * colour, light)
    light = np.where(view.part[..., None], part, light)
    light = np.where(view.empty[..., None], _rgb(PALE), light)
    small = cv2.resize(light.astype(np.float32), (_PANEL, _PANEL), interpolation=cv2.INTER_AREA)
    return Image.fromarray(np.rint(small).astype(np.uint8))


def _rgb(colour: str) -> np.ndarray:
    return np.array(ImageColor.getrgb(colour), np.float64)
