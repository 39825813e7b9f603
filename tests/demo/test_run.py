"""The first grasp: a part is lifted, and its pictures are written."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hal.sim import Film
from mskgrasp.demo import run
from mskgrasp.demo.config import DemoConfig
from mskgrasp.demo.run import STAGES, Demo, demo_text, demonstrate
from tests.figures import picture
from tests.planning.hand_made import FRAME, planner


def test_a_part_is_lifted_and_filmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    # A quarter of the pixels, which software renders one by one.
    monkeypatch.setattr(run, "Film", partial(Film, n_pixels=200))
    demo = demonstrate(DemoConfig(out=tmp_path / "demo"))
    assert not demo.failure
    # A shift that can be seen, and one that the network knows: by zero it would miss twice as much.
    error = np.linalg.norm(demo.displacement[:3] - demo.plan.displacement[:3])
    assert np.linalg.norm(demo.displacement[:3]) > max(3e-3, 2 * error)
    assert picture(tmp_path / "demo" / "plan.png").shape[1] > 1000
    with Image.open(tmp_path / "demo" / "grasp.gif") as film:
        assert getattr(film, "n_frames", 1) > 40
    assert (tmp_path / "demo" / "grasp.gif").stat().st_size < 2_000_000
    assert STAGES[-1] in capsys.readouterr().err


def test_the_text_states_the_expected_and_the_measured_shift_or_the_failure():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    lines = demo_text(
        Demo(plan=plan, failure="", displacement=np.array([1e-3, -2e-3, 0.0, 0.1]))
    ).splitlines()
    assert "dx +1.0 mm, dy -2.0 mm, turn +5.7 deg" in lines[-1]
    expected = re.search(r"dx ([-+\d.]+) \+- ([\d.]+) mm", lines[-2])
    assert expected is not None and float(expected[1]) == round(1e3 * plan.displacement[0], 1)
    failed = demo_text(Demo(plan=plan, failure="it slipped", displacement=np.zeros(4)))
    assert failed == "the part was not lifted: it slipped; try another --seed"
