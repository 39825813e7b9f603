"""The report of a calibration, of pictures whose camera measures 13 mm too far."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from hal.calibrate.board_views import Picture, take_pictures
from hal.calibrate.hand_eye import HandEye, solve_hand_eye
from hal.calibrate.report import (
    DepthOffset,
    depth_offset,
    describe,
    describe_table,
    draw_corners,
    draw_residuals,
)
from hal.table import TablePlane
from mskgrasp.core.geometry import Pose
from mskgrasp.core.palette import PALE, PALE_RED
from tests.hal.calibrate.toy_bench import BOARD, DEPTH_ERROR, HELD, OVERHEAD, bench


@pytest.fixture(scope="module")
def pictures() -> list[Picture]:
    kept: list[Picture] = []
    take_pictures(
        bench(), BOARD, HELD, n=10, tilt_rad=np.radians(30), nearest=0.5, speed=0.2, settle_s=0.1,
        rng=np.random.default_rng(1), keep=lambda _, picture, __: kept.append(picture),
    )  # fmt: skip
    return kept


@pytest.fixture(scope="module")
def found(pictures: list[Picture]) -> HandEye:
    return solve_hand_eye(BOARD, [picture.view(BOARD) for picture in pictures])


@pytest.fixture(scope="module")
def exact(found: HandEye) -> HandEye:
    """The same with the true poses, which the camera drew from."""
    return dataclasses.replace(found, T_base_camera=OVERHEAD, T_tcp_board=HELD)


def test_the_depth_error_of_the_camera_is_found_with_its_sign(exact: HandEye, pictures: list[Picture]):
    offset = depth_offset(BOARD, pictures, exact)
    assert offset is not None
    assert offset.metres == pytest.approx(DEPTH_ERROR, abs=1e-5) and offset.spread < 1e-5
    assert offset.n_views == len(exact.used)


def test_pictures_without_depth_on_the_board_are_not_compared(exact: HandEye, pictures: list[Picture]):
    blind = [dataclasses.replace(picture, depth=np.full_like(picture.depth, np.nan)) for picture in pictures]
    assert depth_offset(BOARD, blind, exact) is None
    mixed = [*blind[:-2], *pictures[-2:]]
    offset = depth_offset(BOARD, mixed, exact)
    assert offset is not None and offset.n_views == len({*exact.used} & {len(mixed) - 2, len(mixed) - 1})


def lines(found: HandEye, pictures: list[Picture], offset: DepthOffset | None) -> dict[str, str]:
    views = [picture.view(BOARD) for picture in pictures]
    before = Pose(position=found.T_base_camera.position + [0.003, 0, 0.004], quat_wxyz=OVERHEAD.quat_wxyz)
    printed = describe(found, views, before, offset)
    assert all("\n" not in line for line in printed)
    return dict(line.split(maxsplit=1) for line in printed)


def test_the_lines_hold_the_numbers(exact: HandEye, pictures: list[Picture]):
    printed = lines(
        dataclasses.replace(exact, scale=0.97, rms_px=np.array([0.3, 0.4])),
        pictures,
        DepthOffset(metres=0.024, spread=0.001, n_views=9),
    )
    assert printed["camera"].startswith("x 0.5000 m, y 0.0000 m, z 1.0000 m, quaternion wxyz 0.00000 0.70711")
    assert f"{len(exact.used)} of {len(pictures)} used" in printed["pictures"]
    assert "corners 0.35 px" in printed["residuals"]  # sqrt((0.09 + 0.16) / 2)
    assert printed["squares"].startswith("seem -3.00 % larger")
    assert printed["moved"].startswith("by    5.00 mm and 0.000 degrees")  # 3, 0 and 4 mm
    assert "measured +24.0 mm too far, +- 1.0 mm between pictures" in printed["depth"]
    assert printed["depth"].endswith("; add -0.0240 to camera.depth_offset")


@pytest.mark.parametrize(("metres", "spread"), [(0.002, 0.0), (-0.0029, 0.0), (0.01, 0.006)])
def test_a_depth_error_within_its_spread_or_a_warm_up_has_no_remedy(
    exact: HandEye, pictures: list[Picture], metres: float, spread: float
):
    printed = lines(exact, pictures, DepthOffset(metres=metres, spread=spread, n_views=9))
    assert "depth_offset" not in printed["depth"] and f"{1e3 * metres:+.1f} mm" in printed["depth"]


def test_without_depth_the_report_says_so(exact: HandEye, pictures: list[Picture]):
    assert "not compared" in lines(exact, pictures, None)["depth"]


@pytest.mark.parametrize(
    ("offset", "table_z", "words"),
    [
        (None, None, "table_z -0.0240 m"),
        # A camera that measures 24 mm too far sees the table 24 mm too low.
        (0.024, None, "table_z 0.0000 m"),
        (0.024, 0.01, "table_z 0.0000 m by the depth image, what the camera measures too far taken off; "
         "tilted by 1.15 degrees, noise 2.0 mm; the cell file says table_z 0.0100 m"),
    ],
)  # fmt: skip
def test_the_tables_height_is_corrected_by_the_cameras_error(
    offset: float | None, table_z: float | None, words: str
):
    plane = TablePlane(z=-0.024, tilt_rad=0.02, slope=(0.02, 0.0), noise=0.002, share=1.0, valid=1.0)
    error = None if offset is None else DepthOffset(metres=offset, spread=0.0, n_views=3)
    assert words in describe_table(plane, error, table_z)
    assert "not seen" in describe_table(None, error, table_z)


def test_corners_found_and_expected_are_drawn_whether_it_was_solved_or_not(
    exact: HandEye, pictures: list[Picture], tmp_path: Path
):
    """Green circles with a solution and without; red crosses only with one."""
    views = [picture.view(BOARD) for picture in pictures]
    shown = {}
    for name, result in (("solved", exact), ("not", None)):
        path = tmp_path / f"{name}.png"
        draw_corners(BOARD, pictures[:3], views[:3], result, path)
        image = matplotlib.image.imread(path)[..., :3]
        green = ((image[..., 1] - image[..., [0, 2]].max(axis=-1)) > 0.25).sum()
        red = ((image[..., 0] - image[..., 1:].max(axis=-1)) > 0.25).sum()
        shown[name] = (int(green), int(red))
    assert min(shown["solved"]) > 20 and shown["not"][0] > 20 and shown["not"][1] == 0


def test_a_picture_that_was_not_used_is_marked_by_its_reason(
    found: HandEye, pictures: list[Picture], tmp_path: Path
):
    """One with too few corners is grey, one that contradicts the others red."""
    views = [picture.view(BOARD) for picture in pictures]
    few = dataclasses.replace(views[0].corners, ids=np.arange(3), pixels=views[0].corners.pixels[:3])
    views[0] = dataclasses.replace(views[0], corners=few)
    keep = found.used > 1
    result = dataclasses.replace(
        found, used=found.used[keep], rms_px=found.rms_px[keep],
        translation_m=found.translation_m[keep], rotation_rad=found.rotation_rad[keep],
    )  # fmt: skip
    draw_residuals(views, result, tmp_path / "residuals.png")
    image = (matplotlib.image.imread(tmp_path / "residuals.png")[..., :3] * 255).round().astype(int)
    for colour in (PALE, PALE_RED):
        rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert (np.abs(image - rgb).max(axis=-1) <= 1).sum() > 500, colour
