"""Sections of a report, and the one with settings and versions."""

from __future__ import annotations

import importlib.metadata
import json
import platform
import subprocess
import sys
from pathlib import Path

import mskgrasp
from mskgrasp.core.settings import ExecutionNoise
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Table


def test_a_section_is_empty_unless_it_has_text_a_table_or_a_figure():
    assert not Section(title="Nothing") and not Section(title="Nothing", page_only=True)
    assert Section(title="Text", text=["x"])
    assert Section(title="Table", tables=[Table(header=("a",), rows=[])])
    assert Section(title="Figure", figures=[Figure(path=Path("a.png"), caption="")])


def test_nested_settings_are_named_by_their_path_as_on_the_command_line():
    noise = ExecutionNoise(finger_force=(10, 30)).model_dump(mode="json")
    section = settings_section(dict(seed=0, noise=noise, parts=["a", "b"], cell=None, planner={}))
    rows = dict(section.tables[0].rows)
    assert rows["seed"] == "0" and rows["parts"] == "a, b" and rows["cell"] == "not set"
    assert rows["noise.finger_force"] == "10.0, 30.0" and rows["noise.friction_pad_part"] == "not set"
    assert "noise" not in rows and "planner" not in rows
    assert section.page_only  # too long for a console


def test_versions_are_those_of_this_process_unless_they_are_given():
    rows = dict(settings_section({}).tables[1].rows)
    assert rows["mskgrasp"] == mskgrasp.__version__ and rows["python"] == platform.python_version()
    assert rows["numpy"] == importlib.metadata.version("numpy") and rows["sapien"].startswith("3.")
    given = settings_section({}, {"simulation": 2, "library": {"torch": "2"}}).tables[1].rows
    assert list(given) == [("simulation", "2"), ("library.torch", "2")]


def test_a_package_that_is_not_installed_is_left_out():
    """MuJoCo is an extra: an interpreter in which its metadata cannot be found."""
    program = (
        "import importlib.metadata as m, json\n"
        "from mskgrasp.reports.section import settings_section\n"
        "version = m.version\n"
        "def without(name):\n"
        "    if name == 'mujoco':\n"
        "        raise m.PackageNotFoundError(name)\n"
        "    return version(name)\n"
        "m.version = without\n"
        "print(json.dumps(dict(settings_section({}).tables[1].rows)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "numpy" in json.loads(done.stdout) and "mujoco" not in json.loads(done.stdout)
