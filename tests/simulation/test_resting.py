"""Resting poses that stand in the engine, settled once for each part."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part, build_part
from mskgrasp.simulation import resting
from mskgrasp.simulation.resting import Resting, resting_of


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def wing_nut(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Part:
    """A part with narrow faces, from which it topples in the engine."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    return build_part("wing_nut_m20")


@pytest.mark.slow
def test_toppling_poses_are_those_that_attempts_leave_out(wing_nut: Part):
    found = resting_of(wing_nut)
    assert len(found.stands) == len(wing_nut.resting_probability)
    assert 0 < found.stands.count(False) < len(found.stands)
    # As a collector would start it: the task settles the part in its own scene.
    program = (
        "import gymnasium, tasks, sys\n"
        "env = gymnasium.make('GraspDisplacement-v1', parts=[sys.argv[1]], obs_mode='none')\n"
        "env.reset(seed=0)\n"
        "standing = env.unwrapped.standing[0]\n"
        "print(standing.toppled, len(standing.probability))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(wing_nut.folder)], capture_output=True, text=True, check=True
    )
    toppled, standing = done.stdout.split()
    assert found.toppled == pytest.approx(float(toppled), abs=1e-9)
    assert found.stands.count(True) == int(standing)


def test_a_part_that_topples_from_no_pose_has_none_left_out(cache: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    found = resting_of(build_part("hex_nut_m30"))
    assert all(found.stands) and found.toppled == 0


def test_a_part_is_settled_once_and_again_with_other_settings(
    wing_nut: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = resting_of(wing_nut)
    monkeypatch.setattr(resting, "_settle", lambda *_: pytest.fail("was settled before"))
    assert resting_of(wing_nut) == first
    monkeypatch.setattr(resting, "_settle", lambda part, _: [True] * len(part.resting_probability))
    other = Physics(friction_table_part=0.7)
    assert resting_of(wing_nut, other).toppled == 0 < resting_of(wing_nut).toppled
    for path in (tmp_path / "mskgrasp" / "resting").iterdir():
        path.write_text('{"stands": [true]}')
    assert all(resting_of(wing_nut).stands)  # settled again: the stored list is too short


def test_a_cache_that_cannot_be_written_is_not_used(wing_nut: Part, tmp_path: Path, monkeypatch):
    (tmp_path / "mskgrasp").mkdir()
    (tmp_path / "mskgrasp" / "resting").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert resting_of(wing_nut).toppled > 0


@pytest.mark.slow
def test_no_renderer_is_needed(wing_nut: Part):
    program = (
        "import sys\n"
        "from mskgrasp.parts import find_part\n"
        "from mskgrasp.simulation.resting import _settle\n"
        "from mskgrasp.core.settings import Physics\n"
        "print(_settle(find_part(sys.argv[1]), Physics()))\n"
    )
    without = {"VK_ICD_FILENAMES": "/nonexistent", "VK_DRIVER_FILES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", program, str(wing_nut.folder)], capture_output=True, text=True, check=True,
        env=dict(os.environ, **without),
    )  # fmt: skip
    assert done.stdout.strip() == str(list(resting_of(wing_nut).stands))


def test_what_is_left_out_is_weighed_by_probability():
    found = Resting(stands=(True, False, True, False), probability=(0.2, 0.1, 0.1, 0.1))
    assert found.toppled == pytest.approx(0.4)
