"""The viewer as a program, and its page in a browser."""

from __future__ import annotations

import re
import signal
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import SIMULATED_CELL
from mskgrasp.dataset import open_dataset
from mskgrasp.parts import find_part
from mskgrasp.runtime.run_folder import TRIALS, append_trial
from mskgrasp.trials.trial_files import trial_file, write_trial
from mskgrasp.view.__main__ import main
from mskgrasp.view.config import ViewConfig
from mskgrasp.view.run import cell_file, first_part, start_text
from tests import browser
from tests.collecting import PARTS
from tests.evaluate.made_trials import trial
from tests.planning.hand_made import FRAME, planner
from tests.programs import run_here, running

PANELS = {
    "part": "resting pose",
    "dataset": "attempts pass",
    "run": "measured: dx",
    "cell": "planned in",
}
"""Text of each panel once it is drawn."""


@pytest.fixture
def stored_run(tmp_path: Path) -> Path:
    one = trial(part=PARTS[1], pose_base_obj=[0.45, 0.02, 0.013, 1, 0, 0, 0])
    append_trial(tmp_path / TRIALS, one.to_json())
    write_trial(trial_file(tmp_path, one.key), FRAME, planner().plan(FRAME, np.random.default_rng(0)), None)
    return tmp_path


def test_every_panel_opens_in_a_browser_without_an_error(tmp_path: Path, collected: Path, stored_run: Path):
    options = ["--part", PARTS[1], "--data", str(collected), "--run", str(stored_run)]
    options += ["--cell", str(SIMULATED_CELL), "--planner.n-candidates", "300"]
    with running("mskgrasp.view", "--port", "0", *options) as program:
        line = program.stdout.readline()  # pyright: ignore[reportOptionalMemberAccess]
        found = re.match(r"(http://127\.0\.0\.1:\d+): part hex_nut_m30, dataset ", line)
        assert found, line + program.stderr.read()  # pyright: ignore[reportOptionalMemberAccess]
        # Small, as it is drawn without a GPU.
        with browser.Page(f"{found[1]}/", width=640, height=360, webgl=True) as page:
            for name, text in PANELS.items():
                page.press(name)
                page.wait_for(f"document.body.innerText.includes({text!r})", 240)
                if name == "cell":
                    page.screenshot(tmp_path / "page.png")
            assert (
                page.evaluate("document.querySelector('canvas').getContext('webgl2').isContextLost()")
                is False
            )
            assert page.errors == []
        # A page on which nothing is drawn in 3-D has some twenty colours of text and buttons.
        picture = cv2.imread(str(tmp_path / "page.png"))
        assert picture is not None and len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
        program.send_signal(signal.SIGINT)
        _, complaints = program.communicate(timeout=60)
        assert program.returncode == 130 and "stopped by Ctrl-C" in complaints, complaints
        assert "Traceback" not in complaints


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--host", "0.0.0.0"), "this page can move an arm"),
        (("--part", "hex_nut_m3o"), "hex_nut_m3o"),
        (("--data", "nowhere"), "no dataset folder nowhere"),
        (("--run", "nowhere"), "no run of evaluate or palletize in nowhere"),
        (("--cell", "nowhere.yaml"), "cannot read configuration nowhere.yaml"),
        (("--planner.policy", "certified"), "needs the part on the table: --part NAME"),
        (("--host", "no.such.host.invalid", "--allow-remote"), "cannot listen on no.such.host.invalid"),
    ],
)
def test_what_cannot_be_shown_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch, arguments: tuple[str, ...], message: str
):
    monkeypatch.chdir(tmp_path)
    ended = run_here(main, "--port", "0", *arguments)
    assert ended.returncode == 2 and message in ended.stderr and ended.stderr.count("\n") == 1


def test_a_missing_extra_is_one_line_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    ended = run_here(main)
    assert ended.returncode == 2 and "EXTRAS=dev,view .ci/setup" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_a_dataset_or_a_run_is_shown_without_a_cell_unless_one_is_named():
    assert cell_file(ViewConfig(part=PARTS[1])) == SIMULATED_CELL == cell_file(ViewConfig())
    assert cell_file(ViewConfig(data=Path("d"))) is None is cell_file(ViewConfig(run=Path("r")))
    assert cell_file(ViewConfig(data=Path("d"), cell=Path("c.yaml"))) == Path("c.yaml")


def test_the_part_comes_first_among_those_of_the_dataset(collected: Path):
    dataset = open_dataset(collected)
    assert first_part(dataset, find_part(PARTS[1])) == PARTS[1] and first_part(dataset, None) is None
    with pytest.raises(UsageError, match="no attempts at part 'hinge_60x30'"):
        first_part(dataset, find_part("hinge_60x30"))


def test_the_line_that_is_printed_is_an_address_that_can_be_opened():
    config = ViewConfig(host="::1", part="a", run=Path("out/r"))
    assert start_text(config, 81, None) == "http://[::1]:81: part a, run out/r; Ctrl-C stops"
