"""The interface of the vendors' drivers, against both vendors' packages."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from dataclasses import asdict

import numpy as np
import pytest

from hal.franka.driver import MODES, Driver, DriverSettings, DriverState, column_major, felt_force
from hal.franka.franky_driver import FrankyDriver
from hal.franka.panda_py_driver import PandaPyDriver

SETTINGS = DriverSettings(
    host="172.16.0.2", realtime=True, contact_torque=[20.0] * 7, contact_force=10.5,
    stiffness=[600.0] * 7, damping=[0.1 * k for k in range(7)], settle_s=1.5,
)  # fmt: skip
STATE = DriverState(
    joints=[0.1 * k for k in range(7)], o_t_ee=[float(k) / 3 for k in range(16)], f_t_ee=[0.0] * 16,
    width=0.04, max_width=0.0797, grasped=True, ee_mass=0.73, ee_centre=[-0.01, 0.0, 0.03],
    load_mass=0.25, mode="reflex", errors='["cartesian_reflex"]', seconds=12345.678901,
)  # fmt: skip


@pytest.mark.parametrize("package", ["franky", "panda_py.libfranka"])
def test_a_robots_mode_has_the_same_number_in_both_packages(package: str):
    """libfranka numbers them; a driver looks a mode up by its number."""
    code = (
        f"import json, {package}\nmodes = {package}.RobotMode\n"
        "names = [name for name in dir(modes) if name.lstrip('k')[:1].isupper()]\n"
        "print(json.dumps({int(getattr(modes, name)): name.lstrip('k') for name in names}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    names = {int(number): name for number, name in json.loads(done.stdout).items()}
    own = {"UserStopped": "user_stopped", "AutomaticErrorRecovery": "recovery"}
    assert sorted(names) == list(range(len(MODES)))
    assert tuple(own.get(names[number], names[number].lower()) for number in sorted(names)) == MODES


def verbs(kind: type) -> dict[str, list[str]]:
    return {
        name: list(inspect.signature(found).parameters)
        for name, found in vars(kind).items()
        if inspect.isfunction(found) and not name.startswith("_")
    }


@pytest.mark.parametrize("kind", [FrankyDriver, PandaPyDriver])
def test_both_drivers_have_the_verbs_of_the_interface_and_no_other(kind: type):
    assert verbs(kind) == verbs(Driver)
    assert len(verbs(Driver)) == 10


@pytest.mark.parametrize("message", [SETTINGS, STATE], ids=["settings", "state"])
def test_a_message_survives_the_pipe(message: DriverSettings | DriverState):
    assert type(message)(**json.loads(json.dumps(asdict(message)))) == message


def test_a_matrix_is_sent_column_by_column():
    matrix = np.arange(16).reshape(4, 4)  # 0 1 2 3 in the first row
    assert column_major(matrix) == [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15]
    assert all(type(value) is float for value in column_major(matrix))


def test_the_force_of_a_contact_is_what_was_not_there_at_the_start():
    """The force estimate at rest is a model's error; moments do not count."""
    assert felt_force([1.0, 2.0, 8.0, 9.0, 9.0, 9.0], [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]) == pytest.approx(5.0)
    assert felt_force([3.0, 0.0, 4.0, 0, 0, 0], [0.0] * 6) == pytest.approx(5.0)
