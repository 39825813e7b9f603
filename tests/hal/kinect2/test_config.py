"""Settings of a Kinect."""

from __future__ import annotations

import pytest

from hal.kinect2 import Kinect2Config
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


def test_a_serial_without_quotes_is_explained():
    with pytest.raises(BadConfig, match="must be in quotes"):
        check_config(Kinect2Config, dict(driver="kinect2", serial=12345, calibration="c.yaml"), "cell.yaml")
