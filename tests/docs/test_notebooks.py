"""The tutorials are small, hold no outputs, and run."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.notebooks import TUTORIALS, as_markdown, notebooks, read_cells
from tests.docs.pages import ROOT

NOTEBOOKS = pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)


def run(name: str, folder: Path, **variables: str) -> str:
    """What the cells of a tutorial print in a folder."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.docs.notebooks", str(TUTORIALS / f"{name}.ipynb")],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | variables,
        capture_output=True,
        text=True,
        timeout=1800,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_there_are_the_tutorials_that_the_start_page_names():
    start = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    named = re.findall(r"\(tutorials/(\w+)\.ipynb\)", start)
    assert sorted(named) == [path.stem for path in notebooks()] and len(named) == 4


@NOTEBOOKS
def test_a_notebook_is_stored_small_and_without_outputs(path: Path):
    book = json.loads(path.read_text(encoding="utf-8"))
    assert book["nbformat"] == 4 and path.stat().st_size < 20_000
    assert not [cell for cell in read_cells(path) if cell.stored]
    names = [cell["id"] for cell in book["cells"]]
    assert len(set(names)) == len(names)


@NOTEBOOKS
def test_a_notebook_begins_with_a_title_and_holds_plain_python(path: Path):
    first, *cells = read_cells(path)
    assert first.kind == "markdown" and first.source.startswith("# ")
    code = [cell.source for cell in cells if cell.kind == "code"]
    assert code
    for source in code:
        compile(source, path.name, "exec")


def test_a_notebook_becomes_a_page_with_its_code_and_a_link_to_itself(tmp_path: Path):
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "Text."]},
        {"cell_type": "code", "source": ["x = 1\n", "print(x)"], "outputs": [{}], "execution_count": 3},
    ]
    path = tmp_path / "note.ipynb"
    path.write_text(json.dumps({"cells": cells}))
    page = as_markdown(path)
    assert page.startswith("# Title\nText.\n\nThis page is a notebook: [note.ipynb](note.ipynb).")
    assert page.endswith("```python\nx = 1\nprint(x)\n```\n")
    assert [len(cell.stored) for cell in read_cells(path)] == [0, 2]


def test_the_backend_tutorial_plans_grasps_and_refuses_with_devices_of_its_own(tmp_path: Path):
    printed = run("backend", tmp_path)
    seen = re.search(r"x ([\d.-]+), y ([\d.-]+), z ([\d.-]+) m, ([\d-]+) degrees.* quality ([\d.]+)", printed)
    assert seen is not None
    *planned, degrees, quality = map(float, seen.groups())
    assert abs(planned[0] - 0.5) < 0.03 and abs(planned[1]) < 0.02 and quality > 0.9
    commanded = re.search(r"^fingers close at \[(.*)\] m, quaternion wxyz \[(.*)\]$", printed, re.MULTILINE)
    assert commanded is not None
    assert [float(number) for number in commanded[1].split()] == pytest.approx(planned, abs=6e-4)
    # The hand points down, turned by the angle of the plan: Rz(theta) Rx(pi).
    w, x, y, z = (float(number) for number in commanded[2].split())
    assert (w, z) == pytest.approx((0, 0), abs=1e-4)
    assert math.degrees(2 * math.atan2(y, x)) == pytest.approx(degrees, abs=0.6)
    assert "\nholding\n" in printed and "refused: TCP target z 0.0000 m" in printed


@pytest.mark.slow
def test_a_part_is_grasped_and_assessed_in_its_tutorial(tmp_path: Path):
    # Its quick certified grasps must not replace others of the same part.
    printed = run("your_part", tmp_path, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert (
        re.search(r"^example_bracket: \d+ g, ", printed, re.MULTILINE)
        and "lifted, predicted quality" in printed
    )
    rows = re.findall(r"lifted (\d+) of (\d+) \{", printed)
    assert rows and all(0 < int(of) and int(n) <= int(of) for n, of in rows)
    assert (tmp_path / "out" / "my_part" / "assess" / "report.html").is_file()


@pytest.mark.slow
def test_a_dataset_is_collected_and_networks_are_trained_on_it_in_their_tutorials(tmp_path: Path):
    printed = run("dataset", tmp_path)
    assert "12 shards, 240 attempts, 0 faults" in printed
    assert re.findall(r"^  \S+: \d+% of (\d+)$", printed, re.MULTILINE) == 6 * ["40"]
    printed = run("train_and_compare", tmp_path)
    found = re.findall(r"^(shipped|trained) +AUROC ([\d.]+) +RMSE ([\d.]+) mm$", printed, re.MULTILINE)
    assert [name for name, _, _ in found] == ["shipped", "trained"]
    assert float(found[0][2]) < float(found[1][2])  # of 182 730 attempts, against 80
    assert (tmp_path / "models" / "mine" / "model.safetensors").is_file()
