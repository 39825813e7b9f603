"""Settings of a Kinect."""

from __future__ import annotations

import pytest

from hal.kinect2 import Kinect2Config
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


def test_a_serial_without_quotes_is_explained():
    with pytest.raises(BadConfig, match="must be in quotes"):
        check_config(Kinect2Config, dict(driver="kinect2", serial=12345, calibration="c.yaml"), "cell.yaml")


@pytest.mark.parametrize("setting", [dict(exposures=0), dict(exposures=21), dict(colour_scale=5)])
def test_exposures_and_scale_out_of_range_are_named(setting: dict[str, int]):
    with pytest.raises(BadConfig, match=next(iter(setting))):
        check_config(Kinect2Config, dict(driver="kinect2", calibration="c.yaml", **setting), "cell.yaml")
