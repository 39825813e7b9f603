"""Figures of placements: where things are, and the numbers beside them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.palletize import figures
from mskgrasp.palletize.height_maps import HeightMaps
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.summary import compared_groups
from tests import synthetic
from tests.figures import keep_figures, legend_labels, picture
from tests.palletize.made_placements import placement, some

SLOTS = [Slot(x=0.45, y=0.06, theta=0.0, size=(0.06, 0.04)), Slot(x=0.45, y=-0.04, theta=1.0)]


def painted(z: float) -> RgbdFrame:
    """A frame in which every pixel is coloured by the place of the base that it shows at height z.

    Red counts millimetres along base x from 0.3 m on, green along base y from -0.12 m on.
    """
    frame = synthetic.frame([])
    rows, columns = np.mgrid[: frame.depth.shape[0], : frame.depth.shape[1]]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame.intrinsics).T
    rays = rays @ quat_to_matrix(frame.T_base_camera.quat_wxyz).T
    height = frame.T_base_camera.position[2] - z
    points = frame.T_base_camera.position + rays * (height / -rays[..., 2:])
    colour = np.zeros((*frame.depth.shape, 3))
    colour[..., 0], colour[..., 1] = 1e3 * (points[..., 0] - 0.3), 1e3 * (points[..., 1] + 0.12)
    return dataclasses.replace(frame, colour=np.clip(np.rint(colour), 0, 255).astype(np.uint8))


def shown(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places along base x and y, metres, that the colours of an image state."""
    return image[..., 0] / 1e3 + 0.3, image[..., 1] / 1e3 - 0.12


def places(image: np.ndarray, bounds: tuple[float, float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Places along base x and y, metres, of the middles of an image's pixels of 1 mm: x up, y to the left."""
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
    return bounds[1] - (rows + 0.5) * 1e-3, bounds[3] - (columns + 0.5) * 1e-3


def test_bounds_hold_all_slots_with_a_margin_of_a_centimetre():
    bounds = figures.pallet_bounds(SLOTS)
    # A slot of unknown size counts as a square of 10 cm.
    assert bounds == pytest.approx((0.45 - 0.06, 0.45 + 0.06, -0.04 - 0.06, 0.06 + 0.03))


def test_a_pixel_of_the_rectified_pallet_shows_its_place_on_the_table():
    image = figures.pallet_image(painted(0.0), SLOTS, 0.0, {})
    bounds = figures.pallet_bounds(SLOTS)
    assert image.shape == (120, 190, 3)
    for found, true in zip(shown(image), places(image, bounds), strict=True):
        np.testing.assert_allclose(found, true, atol=2e-3)


def test_in_a_filled_slot_of_known_size_the_top_of_the_part_is_shown_without_parallax():
    table, top = (figures.pallet_image(painted(z), SLOTS, 0.0, {0: 0.05, 1: 0.05}) for z in (0.0, 0.05))
    x, y = places(top, figures.pallet_bounds(SLOTS))
    inside = (np.abs(x - 0.45) < 0.028) & (np.abs(y - 0.06) < 0.018)
    outside = (np.abs(x - 0.45) > 0.032) | (np.abs(y - 0.06) > 0.022)
    for found, true in zip(shown(top), (x, y), strict=True):
        np.testing.assert_allclose(found[inside], true[inside], atol=2e-3)
    for found, true in zip(shown(table), (x, y), strict=True):
        np.testing.assert_allclose(found[outside], true[outside], atol=2e-3)
    # Elsewhere a plane 5 cm higher appears displaced: it is a correction, not the same image.
    assert np.abs(shown(top)[1][outside] - y[outside]).max() > 4e-3


def test_an_outcome_is_described_with_its_errors():
    assert figures.placement_text(placement("a", 0, "none", 4.0)) == "4.0 mm, 2.3° off"
    assert figures.placement_text(placement("a", 0, "none", None)) == "not placed (missed)"
    unmeasured = placement("a", 0, "none", None, placed=True, reason="", unmeasured="no tape")
    assert figures.placement_text(unmeasured) == "placed, not measured"


def test_errors_are_distributions_with_their_medians_and_parts_under_both_corrections(tmp_path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    figures.draw_errors(some(), tmp_path / "errors.png")
    shift, turn, parts = kept[0].axes
    assert legend_labels(shift) == [
        "no correction: median 6.0", "corrected by the prediction: median 2.0",
        "corrected by the truth: median 0.2",
    ]  # fmt: skip
    assert shift.lines[0].get_xdata().tolist() == pytest.approx([0, 4, 6, 20])
    assert shift.lines[0].get_ydata().tolist() == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert np.degrees(0.06) == pytest.approx(turn.lines[0].get_xdata()[2])
    points = next(line for line in parts.lines if line.get_marker() == "o")
    assert np.c_[points.get_data()] == pytest.approx(np.array([[4, 1], [6, 3], [20, 2]]))
    picture(tmp_path / "errors.png")


def test_without_a_measurement_the_figure_says_so(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    figures.draw_errors([placement("a", 0, "none", None)], tmp_path / "errors.png")
    assert "no placement was measured" in [text.get_text() for text in kept[0].axes[0].texts]
    picture(tmp_path / "errors.png")


def bar() -> HeightMaps:
    """A bar of 60 x 10 mm along base x before, turned by a quarter turn and placed."""
    before = np.zeros((200, 200))
    before[90:110, 40:160] = 0.02
    return HeightMaps(
        before=before, after=before.T.copy(), side=0.1, top=0.02, grasp=np.zeros(3), turn=np.pi / 2,
        theta=np.pi / 2,
    )  # fmt: skip


def test_the_outline_at_the_target_is_the_parts_outline_turned_by_the_target(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    figures.draw_placement(bar(), placement("a", 0, "predicted", 1.0), tmp_path / "one.png")
    for axes, size in zip(kept[0].axes, ((60, 10), (10, 60)), strict=True):
        (outline,) = [one for one in axes.collections if type(one).__name__ == "QuadContourSet"]
        corners = np.concatenate([path.vertices for path in outline.get_paths()])
        np.testing.assert_allclose(np.ptp(corners, axis=0), size, atol=1.0)
    assert kept[0].get_suptitle() == "a: 1.0 mm, 0.6° off"
    assert kept[0].axes[1].get_title(loc="left") == "after, corrected by the prediction"


def test_parts_stand_in_rows_and_corrections_in_columns(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    lost = dataclasses.replace(bar(), after=np.empty((0, 0)))
    rows = []
    for group in compared_groups(some())[:2]:
        maps = {"none": bar(), "predicted": lost, "truth": bar()}
        rows.append((group["none"], maps, group))
    figures.draw_corrections(rows, tmp_path / "placed.png")
    axes = np.array(kept[0].axes).reshape(2, 4)
    assert [one.get_title(loc="left") for one in axes[0]] == [
        "before", "no correction", "corrected by the prediction", "corrected by the truth",
    ]  # fmt: skip
    assert [one.get_ylabel() for one in axes[:, 0]] == ["a", "b"]
    assert axes[1, 1].get_xlabel() == "6.0 mm, 3.4° off"
    assert [text.get_text() for text in axes[0, 2].texts] == ["not placed"]


def test_a_pallet_shows_every_slots_target_at_its_place(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    image = figures.pallet_image(painted(0.0), SLOTS, 0.0, {})
    figures.draw_pallets({"none": image, "truth": image}, SLOTS, "pallet 1", tmp_path / "pallet.png")
    assert [axes.get_title(loc="left") for axes in kept[0].axes] == [
        "no correction",
        "corrected by the truth",
    ]
    axes = kept[0].axes[0]
    middles = [line.get_xydata().mean(axis=0) for line in axes.lines]
    # Right is -y and up is +x, in millimetres; two arms each, the longer one first.
    np.testing.assert_allclose(middles, [[-60, 450], [-60, 450], [40, 450], [40, 450]], atol=1e-9)
    along = np.diff(axes.lines[0].get_xydata(), axis=0)[0]
    assert abs(along[0]) < 1e-9 < along[1]  # theta 0 is along base x, which is up
