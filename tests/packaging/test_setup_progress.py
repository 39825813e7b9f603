"""Progress of the set-up, from what pip prints."""

from __future__ import annotations

import subprocess
from pathlib import Path

PROGRESS = Path(__file__).parents[2] / ".ci" / "pip_progress"


def shown(*lines: str) -> list[str]:
    done = subprocess.run(
        [PROGRESS, "180"], input="\n".join(lines) + "\n", check=True, capture_output=True, text=True
    )
    assert not done.stdout
    return done.stderr.splitlines()


def test_every_25th_package_large_downloads_and_the_number_installed_are_shown():
    found = [f"Collecting package-{k}>=1.0 (from other)" for k in range(1, 27)]
    lines = shown(
        "Looking in indexes: https://pypi.org/simple",
        *found,
        "  Downloading small-1.0-py3-none-any.whl (126 kB)",
        "  Downloading middling-1.0-py3-none-any.whl (16.6 MB)",
        "  Downloading https://files/torch-2.13.0-cp311.whl (820.1 MB)",
        "Requirement already satisfied: numpy in ./.venv",
        "Installing collected packages: a, b, c",
        "Successfully installed a-1 b-2 c-3",
    )
    assert lines == [
        "  25 packages found (at most 180): package-25>=1.0",
        "  downloading torch-2.13.0-cp311.whl (820.1 MB)",
        "  installing 3 packages",
    ]


def test_nothing_to_install_is_silent():
    assert shown("Requirement already satisfied: numpy in ./.venv") == []


def test_the_set_up_counts_its_steps():
    setup = (PROGRESS.parent / "setup").read_text(encoding="utf-8")
    always = 4
    assert f"STEPS={always}\n" in setup
    steps = [line for line in setup.splitlines() if line.lstrip().startswith("step ") or "then step " in line]
    assert len(steps) == always + 2  # and a compiler, and a browser
