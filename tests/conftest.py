"""Fixtures of all tests."""

from __future__ import annotations

import fcntl
import gc
import os
import signal
from pathlib import Path

# One core a process, here and in all that are started: the tests measure nothing, and threads of torch,
# OpenBLAS and Mesa only get in each other's way. Read when those are loaded.
os.environ |= {"OMP_NUM_THREADS": "1", "LP_NUM_THREADS": "1"} | os.environ
# Hundreds of processes are started, each of which would compile all modules of the checkout.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest
from hypothesis import settings

from tests.collecting import collect

# How long an example takes says more of the machine than of the code.
settings.register_profile("mskgrasp", deadline=None)
settings.load_profile("mskgrasp")

# Shells start background jobs with Ctrl-C ignored, which the programs under test would inherit.
signal.signal(signal.SIGINT, signal.default_int_handler)

LONGEST = (
    "hal_contract/test_arm_contract.py",
    "hal/franka/test_faults.py",
    "evaluate/test_run.py",
    "hal/kinect2/test_camera.py",
    "collect/test_run.py",
    "hal_contract/test_simulated_cells.py",
    "assess/test_run.py",
    "learning/test_trainer.py",
    "parts/recipes/test_families.py",
    "validate/test_run.py",
    "train/test_run.py",
    "view/test_run.py",
    "kills/test_kills.py",
    "collect/test_crashes.py",
    "hal_contract/test_same_code.py",
)
"""Files that take most of a minute, or a third of one and come last by their names, and at the end three that
take long with the slow tests: started first, so that no process is left alone with one."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    tests = Path(__file__).parent
    rank = {tests / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


def pytest_collection_finish() -> None:
    """Simulators collect garbage at every new scene; the modules loaded by now need no scan."""
    gc.freeze()


@pytest.fixture(scope="session")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small dataset made by one worker without any trouble, for all processes; not to be changed."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "collected"
    folder.mkdir(exist_ok=True)
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # whoever comes first makes it
        if not (folder / "made").exists():
            done = collect(folder / "data", "--workers", "1")
            assert done.returncode == 0, done.stderr
            (folder / "made").touch()
    return folder / "data"
