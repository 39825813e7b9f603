"""The driver of a Kinect in this process, on the fake package: which camera, which frame, and why none."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hal.errors import CaptureFailed, CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected
from hal.kinect2.driver import Kinect2Driver, Kinect2Settings, import_vendor
from tests.hal.kinect2.bench import SERIAL, Bench

TIMEOUT_S = 20.0


@contextmanager
def driver(**changes: Any) -> Iterator[Kinect2Driver]:
    """Open and streaming."""
    settings: dict[str, Any] = dict(
        serial=None, pipeline="cpu", latency_s=0.1, max_skew_s=0.1, timeout_s=TIMEOUT_S, n_exposures=1
    )
    opened = Kinect2Driver(Kinect2Settings(**(settings | changes)))
    yield opened
    opened.close()


def test_the_only_camera_is_taken_and_its_factory_calibration_is_read(fake: ModuleType, bench: Bench):
    with driver() as opened:
        assert opened.serial == SERIAL
        assert opened.lens == fake.scene.INFRARED and opened.colour == fake.scene.COLOUR


def test_the_wanted_camera_of_several_is_taken(fake: ModuleType, bench: Bench):
    bench.set(serials=["1", SERIAL, "2"])
    with driver(serial=SERIAL) as opened:
        assert opened.serial == SERIAL
    with pytest.raises(NotConnected, match=f"set camera.serial to one of: 1, {SERIAL}, 2"), driver():
        pass


def test_a_frame_is_a_copy_exposed_after_it_was_asked_for(fake: ModuleType, bench: Bench):
    with driver() as opened:
        opened.capture(TIMEOUT_S)
        time.sleep(0.15)  # frames wait in the driver meanwhile
        asked = time.monotonic()
        frame = opened.capture(TIMEOUT_S)
        assert asked <= frame.exposed_s <= time.monotonic()
        assert frame.depth_mm.shape == (424, 512) and frame.depth_mm.dtype == np.float32
        assert frame.infrared.shape == (424, 512) and frame.infrared.dtype == np.float32
        assert frame.colour_bgrx.shape == (1080, 1920, 4) and frame.colour_bgrx.dtype == np.uint8
        images = frame.depth_mm, frame.infrared, frame.colour_bgrx
        kept = [image.copy() for image in images]
        opened.capture(TIMEOUT_S)
        for before, after in zip(kept, images, strict=True):
            assert np.array_equal(before, after, equal_nan=before.dtype == np.float32)


def test_several_exposures_are_merged_by_their_median_and_dated_by_the_first(fake: ModuleType, bench: Bench):
    bench.set(noise_mm=1.3)
    with driver(latency_s=0.4) as one, driver(n_exposures=9, latency_s=0.4) as several:
        table = np.s_[100:320, 60:200]
        single = one.capture(TIMEOUT_S).depth_mm[table]
        asked = time.monotonic()
        merged = several.capture(TIMEOUT_S)
        assert asked <= merged.exposed_s <= time.monotonic() - 8 / 30
        assert single.std() == pytest.approx(1.3, rel=0.05)
        assert merged.depth_mm[table].std() == pytest.approx(0.53, rel=0.08)  # sqrt(pi / 2 / 9) of it
    with driver(n_exposures=20, latency_s=0.4) as slow:
        with pytest.raises(CaptureFailed, match=r"\d+ of 20 exposures within 0.9 s.*lower camera.exposures"):
            slow.capture(0.9)


def test_frames_go_on_where_the_cameras_counter_wraps_round(fake: ModuleType, bench: Bench):
    """Depth's 0.6 s after the start here, colour's, half a second older, 0.5 s later."""
    bench.set(fault="skewed")
    with driver(max_skew_s=0.6) as opened:
        exposed, end = [], time.monotonic() + 1.0
        while time.monotonic() < end:
            exposed.append(opened.capture(0.45).exposed_s)
        assert len(exposed) > 3 and (np.diff(exposed) > 0).all()


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("stalled", "delivered no frame within 0.3 s, its stream stands still"),
        ("frozen", r"no good frame within 0.3 s, but .*\d+ stale \(the camera's clock stands still\)"),
        ("skewed", r"\d+ without colour of the same moment \(max_skew_s 0.1 s\)"),
    ],
)
def test_a_capture_without_a_good_frame_says_what_came_instead(
    fake: ModuleType, bench: Bench, fault: str, message: str
):
    bench.set(fault=fault)
    with driver(latency_s=0.4) as opened:
        with pytest.raises(CaptureFailed, match=message) as caught:
            opened.capture(0.3)
        assert "\n" not in str(caught.value)
        bench.set()


def test_a_camera_that_is_gone_is_distinguished_from_one_that_is_silent(fake: ModuleType, bench: Bench):
    with driver() as opened:
        bench.set(serials=["1"])
        with pytest.raises(CommunicationLost, match=f"camera {SERIAL} is unplugged"):
            opened.capture(0.2)
        bench.set()


def test_a_stream_that_does_not_start_is_an_error(fake: ModuleType, bench: Bench):
    """libfreenect2 reports nothing: the parameters of the lens stay zero."""
    bench.set(start_fails=True)
    with pytest.raises(NotConnected, match=f"camera {SERIAL} did not start"), driver():
        pass


def test_a_library_without_a_decoder_or_a_name_is_named(fake: ModuleType, bench: Bench, monkeypatch):
    with pytest.raises(IncompatibleDriver, match="built without OpenGLPacketPipeline"):
        with driver(pipeline="opengl"):
            pass
    monkeypatch.delattr(fake, "SyncMultiFrameListener")
    monkeypatch.delattr(fake, "FrameType")
    with pytest.raises(
        IncompatibleDriver, match="has no FrameType, SyncMultiFrameListener; install version 0.1.4"
    ):
        import_vendor()


def test_the_package_is_imported_once_and_can_be_asked_for_again(fake: ModuleType):
    assert import_vendor() is fake and import_vendor() is fake


def test_a_package_that_is_missing_or_broken_names_the_remedy(tmp_path: Path, monkeypatch):
    with pytest.raises(DriverMissing, match="not installed; docs/kinect2.md says how to build it"):
        import_vendor()
    (tmp_path / "pylibfreenect2.py").write_text("raise ImportError('libfreenect2.so.0.2: cannot open')")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setitem(sys.modules, "pkg_resources", ModuleType("pkg_resources"))
    with pytest.raises(DriverMissing, match=r"cannot be loaded \(libfreenect2.so.0.2.*LD_LIBRARY_PATH"):
        import_vendor()
