"""Geometry, corrections and faults of the Kinect v2."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal import driver_process
from hal.errors import CaptureFailed, CommunicationLost, DriverMissing, NotConnected
from hal.kinect2 import Kinect2Camera, Kinect2Config
from hal.kinect2.config import PinholeIntrinsics
from mskgrasp.core.config import check_config, read_yaml
from mskgrasp.core.errors import BadConfig, MarkersNotFound, MskgraspError, NoPartFound
from mskgrasp.perception.markers import find_markers
from mskgrasp.perception.part_detection import PartView, view_part
from tests.hal.kinect2.bench import BUSY_S, FAKE, SERIAL, Bench

BLOCK = (0.04, 0.10, -0.03, 0.02)
"""Of fake/pylibfreenect2/scene.py: left, right, top, bottom, m; right of the middle, seen from the camera."""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kinect2Camera]:
    """A connected camera to which nothing happens, for tests that only take frames."""
    with pytest.MonkeyPatch.context() as patch:  # the driver's process keeps its environment
        camera = Bench(tmp_path_factory.mktemp("kinect"), patch).camera()
        camera.connect()
    yield camera
    camera.close()


def test_the_image_is_not_mirrored_and_a_pixel_is_where_its_ray_says(opened: Kinect2Camera):
    frame = opened.capture()
    rows, columns = np.nonzero(frame.depth < 0.775)
    z = 0.75
    left, right = (columns.min() - 0.5, columns.max() + 0.5)
    top, bottom = (rows.min() - 0.5, rows.max() + 0.5)
    (fx, _, cx), (_, fy, cy), _ = frame.intrinsics
    corners = [(left - cx) * z / fx, (right - cx) * z / fx, (top - cy) * z / fy, (bottom - cy) * z / fy]
    # Nearest-neighbour undistortion and the block's edge within a pixel: 2 mm a pixel, half of it each.
    assert corners == pytest.approx(BLOCK, abs=2.2e-3)
    assert np.mean(corners[:2]) == pytest.approx(0.07, abs=1.1e-3)
    assert cx == pytest.approx(511 - 254.878)


def test_depth_is_metres_and_every_kind_of_invalid_is_nan(bench: Bench):
    with bench.camera(depth_offset=-0.020) as camera:
        depth = camera.capture().depth
    for corner in (depth[:20, :20], depth[:20, -20:], depth[-20:, :20], depth[-20:, -20:]):
        assert np.isnan(corner).all()
    assert np.nanmax(depth) == pytest.approx(0.8 + 0.004, abs=1e-6)
    assert np.nanmin(depth) == pytest.approx(0.75 + 0.004, abs=1e-6)


def test_colour_is_rgb_registered_to_depth_and_no_view_of_the_drivers_memory(opened: Kinect2Camera):
    first = opened.capture()
    kept = first.colour.copy(), first.depth.copy()
    opened.capture()
    middle = np.s_[60:-60, 40:-40]  # the colour camera sees less to the top and the bottom
    red = first.colour[middle][..., 0]
    assert (red == 200).mean() > 0.995 and ((red == 200) | (red == 0)).all()  # black: hidden by the block
    # The fake's colour image shows its column in blue: mirrored with depth, it falls from left to right.
    blue = first.colour[212, :, 2].astype(int)
    assert blue[100] > blue[256] + 30 > blue[400] + 60
    assert np.array_equal(kept[0], first.colour) and np.array_equal(kept[1], first.depth, equal_nan=True)


@pytest.mark.parametrize("source", ["factory", "calibration", pytest.param("config", marks=pytest.mark.slow)])
def test_intrinsics_come_from_the_config_then_the_calibration_then_the_factory(bench: Bench, source: str):
    measured = np.array([[366.0, 0, 255.5], [0, 366.5, 210.0], [0, 0, 1]])
    settings: dict[str, Any] = {}
    if source != "factory":
        bench.calibrate(intrinsics=measured)
    if source == "config":
        settings["intrinsics"] = {
            SERIAL: dict(fx=360, fy=361, cx=250, cy=200),
            "other": dict(fx=1, fy=1, cx=1, cy=1),
        }
        with pytest.raises(BadConfig, match="intrinsics.other.fx"):
            check_config(Kinect2Config, dict(driver="kinect2", calibration="c", **settings), "cell")
        del settings["intrinsics"]["other"]
    with bench.camera(**settings) as camera:
        found = camera.capture().intrinsics
    expected = {"factory": 365.456, "calibration": 366.0, "config": 360.0}[source]
    assert found[0, 0] == pytest.approx(expected)


def test_a_frame_is_exposed_after_it_was_asked_for(opened: Kinect2Camera):
    time.sleep(0.3)  # a frame waits in the driver meanwhile
    for _ in range(3):
        asked = time.monotonic()
        assert asked <= opened.capture().timestamp_s <= time.monotonic()


@pytest.mark.parametrize(
    ("fault", "error", "message"),
    [
        ("stalled", CaptureFailed, "its stream stands still"),
        pytest.param("slow", CaptureFailed, "its stream stands still", marks=pytest.mark.slow),
        pytest.param("frozen", CaptureFailed, "stale", marks=pytest.mark.slow),
        pytest.param("late", CaptureFailed, r"more than 0.4 s late \(latency_s\)", marks=pytest.mark.slow),
        pytest.param("skewed", CaptureFailed, "without colour of the same moment", marks=pytest.mark.slow),
        ("dark", CaptureFailed, r"measured 0.0% of its depth image.*min_valid"),
        pytest.param(
            "hung",
            CommunicationLost,
            "did not answer 'capture' within 2.6 s and was killed",
            marks=pytest.mark.slow,
        ),
        ("crash", CommunicationLost, "SIGSEGV"),
    ],
)
def test_a_fault_ends_in_its_error_in_time_and_the_camera_opens_again(
    bench: Bench, fault: str, error: type[MskgraspError], message: str
):
    camera = bench.camera()
    with camera:
        bench.set(fault=fault)
        started = time.monotonic()
        with pytest.raises(error, match=message) as caught:
            camera.capture(1.6)  # a late frame is more than a second under way
        assert time.monotonic() - started < 1.6 + 1.0 + BUSY_S  # timeout, grace
        assert "\n" not in str(caught.value)
        if error is CommunicationLost:
            with pytest.raises(CommunicationLost, match="open the cell again"):
                camera.capture(1.6)
        bench.set()
        if error is CaptureFailed:
            camera.capture()
    with camera:
        camera.capture()


def test_an_unplugged_camera_is_named_and_works_once_it_is_back(bench: Bench):
    camera = bench.camera()
    with camera:
        bench.set(serials=[])
        with pytest.raises(CommunicationLost, match=f"{SERIAL} is unplugged"):
            camera.capture(0.5)
    bench.set()
    with camera:
        camera.capture()


@pytest.mark.parametrize(
    ("world", "settings", "error", "message"),
    [
        (dict(serials=[]), {}, NotConnected, "no Kinect v2 found; check its power"),
        (dict(serials=["1", "2"]), {}, NotConnected, f"{SERIAL} is not connected; connected: 1, 2"),
        (dict(serials=["1", SERIAL]), dict(serial=None), NotConnected, "set camera.serial to one of: 1,"),
        (dict(serials=["1"]), dict(serial=None), BadConfig, f"of camera {SERIAL}, not of camera 1"),
        (dict(held=[SERIAL]), {}, NotConnected, "SIGSEGV.*end other programs that use it"),
        (dict(start_fails=True), {}, NotConnected, "did not start"),
        (dict(fault="stalled"), dict(connect_timeout_s=0.5), CaptureFailed, "no frame within 0.5 s"),
        ({}, dict(serial="1"), BadConfig, f"calibration of camera {SERIAL}, not of camera 1"),
        ({}, dict(calibration="nowhere.yaml"), BadConfig, "no calibration file nowhere.yaml"),
        ({}, dict(pipeline="opengl"), MskgraspError, "built without OpenGLPacketPipeline"),
    ],
)
def test_a_camera_that_cannot_be_used_is_refused_in_one_line(
    bench: Bench, world: dict[str, Any], settings: dict[str, Any], error: type[Exception], message: str
):
    bench.set(**world)
    camera = bench.camera(**settings)
    with pytest.raises(error, match=message) as caught:
        camera.connect()
    assert "\n" not in str(caught.value)
    with pytest.raises(NotConnected):
        camera.capture()


def test_without_the_driver_the_page_about_it_is_named(bench: Bench, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("PYTHONPATH")
    with pytest.raises(DriverMissing, match="docs/kinect2.md says how to build it"):
        bench.camera().connect()


def test_importing_hal_imports_no_driver():
    code = "import hal, hal.kinect2, sys; assert 'pylibfreenect2' not in sys.modules"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(FAKE)}, capture_output=True
    )
    assert done.returncode == 0, done.stderr


def test_after_ctrl_c_no_frame_from_before_it_is_delivered(bench: Bench, monkeypatch: pytest.MonkeyPatch):
    camera = bench.camera()
    with camera:

        class Interrupted(Future):
            def result(self, timeout: float | None = None):
                raise KeyboardInterrupt

        with monkeypatch.context() as patch:
            patch.setattr(driver_process, "Future", Interrupted)
            with pytest.raises(KeyboardInterrupt):
                camera.capture()
        asked = time.monotonic()
        assert camera.capture().timestamp_s >= asked


def test_two_threads_get_a_frame_each(opened: Kinect2Camera):
    frames = []
    threads = [threading.Thread(target=lambda: frames.append(opened.capture())) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(frames) == 2 and frames[0].timestamp_s != frames[1].timestamp_s


def test_a_cold_camera_says_that_its_depth_drifts(bench: Bench, caplog: pytest.LogCaptureFixture):
    with caplog.at_level(logging.WARNING), bench.camera(warm_up_s=1200):
        pass
    assert "drifts by millimetres for the first 20 minutes" in caplog.text


def test_intrinsics_of_another_camera_are_not_used_and_named_once(
    bench: Bench, caplog: pytest.LogCaptureFixture
):
    other = {"000000000001": PinholeIntrinsics(fx=360, fy=361, cx=250, cy=200)}
    with caplog.at_level(logging.WARNING), bench.camera(intrinsics=other) as camera:
        for _ in range(2):
            assert camera.capture().intrinsics[0, 0] == pytest.approx(365.456)
    assert caplog.text.count(f"names 000000000001, not the connected camera {SERIAL}") == 1


TABLE = (0.5, 0.0, 0.4, 0.4, 0.0, 139)
REGION = (0.38, 0.62, -0.12, 0.12)


@pytest.mark.slow
def test_tape_of_12_and_8_mm_is_found_in_the_fine_colour(bench: Bench):
    """On a plate 30 mm high; depth is 24 mm too far, which the camera corrects first."""
    squares = np.array([[0.47, 0.01, 0.03], [0.53, -0.012, 0.03]])
    bench.show_plates(
        TABLE,
        (0.5, 0.0, 0.09, 0.05, 0.03, 195),
        *((x, y, side, side, z, 228) for (x, y, z), side in zip(squares, (0.012, 0.008), strict=True)),
    )
    with bench.camera(colour_scale=3) as camera, bench.camera() as coarse:
        fine = camera.capture(30.0)
        without = coarse.capture(30.0)
    assert fine.fine_colour is not None and fine.fine_colour.shape == (3 * 424, 3 * 512, 3)
    found = find_markers(fine, table_z=0.0, region=REGION)
    assert np.abs(found.points_base - squares).max() < 0.3e-3
    assert found.sides == pytest.approx(np.array([[0.012] * 2, [0.008] * 2]), abs=0.5e-3)
    assert without.fine_colour is None
    with pytest.raises(MarkersNotFound, match="too coarse"):
        find_markers(without, table_z=0.0, region=REGION)


def test_a_washer_shows_in_the_median_of_several_exposures(bench: Bench):
    """4 mm high, 1.3 mm of noise on each exposure, and the ``min_height`` that the file of a cell has."""
    bench.show_plates((0.5, 0.0, 0.024, 0.024, 0.004, None), noise_mm=1.3)
    cell = read_yaml(Path(__file__).parents[3] / "configs" / "cells" / "panda_kinect2.yaml")
    with bench.camera(exposures=Kinect2Config.model_fields["exposures"].default) as camera:
        frame = camera.capture(30.0)
    assert np.nanstd(frame.depth[150:280, 100:200]) < 0.6e-3

    def view(min_height: float) -> PartView:
        return view_part(
            frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=REGION,
            min_height=min_height, alone=True,
        )  # fmt: skip

    seen = view(cell["workspace"]["min_height"])
    assert seen.size == pytest.approx([0.024, 0.024, 0.004], abs=4.4e-3)  # two pixels
    assert seen.size[2] == pytest.approx(0.004, abs=0.6e-3)
    assert seen.centre_base[:2] == pytest.approx([0.5, 0.0], abs=2.2e-3)
    with pytest.raises(NoPartFound):
        view(0.006)


def test_a_pose_measured_by_hand_is_good_for_a_look_and_not_for_a_motion(bench: Bench):
    bench.calibrate(serial="any", n_poses=0)
    camera = bench.camera()
    assert not camera.by_hand  # not known yet
    with camera:
        assert camera.by_hand and camera.capture().depth.size
    bench.calibrate()
    with camera:
        assert not camera.by_hand
