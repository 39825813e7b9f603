"""Contracts that every arm and camera passes: pytest classes that a backend's own tests subclass."""

import pytest

# Before they are imported, so that a failed check shows its values.
pytest.register_assert_rewrite("hal.testing.arm_contract", "hal.testing.camera_contract")

from hal.testing.arm_contract import ArmContract, at_home, stopped_after  # noqa: E402
from hal.testing.camera_contract import CameraContract, Station  # noqa: E402

__all__ = ["ArmContract", "CameraContract", "Station", "at_home", "stopped_after"]
