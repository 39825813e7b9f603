"""The device that renders, and a machine without one; each in a process that has rendered nothing yet."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import sapien

from tasks.scene import renderer

# The file alone: its package would load torch and ManiSkill.
CODE = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("renderer", sys.argv[1])
renderer = importlib.util.module_from_spec(spec)
spec.loader.exec_module(renderer)
try: print(renderer.render_backend())
except renderer.NoRenderer as error: print("refused:", error)
"""


def backend(**environment: str) -> tuple[str, str]:
    """What a new process prints, and what it complains of."""
    done = subprocess.run(
        [sys.executable, "-c", CODE, renderer.__file__],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def test_the_device_is_one_on_which_sapien_renders_and_finding_it_is_silent():
    found, complaints = backend()
    device = {"sapien_cuda": "cuda", "cpu": "cpu"}[found.strip()]
    assert complaints == ""
    assert sapien.render.RenderSystem(sapien.Device(device)).cameras == []
    assert renderer.render_backend() == found.strip()


def test_a_machine_without_a_vulkan_driver_gets_the_command_that_installs_one(tmp_path: Path):
    """The loader is shown a driver that is not there: one line, and none of Vulkan's own."""
    nowhere = str(tmp_path / "none.json")
    printed, complaints = backend(VK_ICD_FILENAMES=nowhere, VK_DRIVER_FILES=nowhere)
    (line,) = printed.splitlines()
    assert line.startswith("refused: no usable Vulkan driver (") and "Mesa 24.3 or newer" in line
    assert "apt-get install" in line
    assert complaints == ""
