"""Small runs of programs that can be killed, and what they leave."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import trimesh
import yaml
from safetensors.numpy import load_file

from mskgrasp.runtime.run_folder import TRIALS
from tests import synthetic
from tests.learning.small import SHORT

PART = "hex_nut_m30"


@dataclass(frozen=True)
class Program:
    """A run of a program.

    Attributes:
        module: The program.
        options: Makes what it reads in a folder; its command line but ``--out``.
        finished: What a run has finished, by name; nothing of it may be lost, changed or doubled.
        files: Names of the files of a run that has ended.
    """

    module: str
    options: Callable[[Path], list[str]]
    finished: Callable[[Path], dict[str, Any]]
    files: tuple[str, ...]


def _train_options(folder: Path) -> list[str]:
    data = synthetic.write_dataset(folder / "data", n_parts=8, n_attempts=60, seed=1)
    config = folder / "train.yaml"
    config.write_text(yaml.safe_dump(SHORT.model_dump(mode="json")))
    return ["--config", str(config), "--data", str(data), "--device", "cpu"]


def _trained(out: Path) -> dict[str, Any]:
    """Epochs by their rows of the log, without the seconds that they took, and the weights."""
    log, weights = out / "log.csv", out / "model.safetensors"
    rows = log.read_text().splitlines()[1:] if log.exists() else []
    found: dict[str, Any] = {",".join(row.split(",")[:2]): row.rpartition(",")[0] for row in rows}
    assert len(found) == len(rows)
    if weights.exists() and (out / "model.json").exists():
        found |= {name: value.tobytes() for name, value in load_file(weights).items()}
        found["description"] = _without_times(json.loads((out / "model.json").read_text()))
    return found


def _evaluate_options(folder: Path) -> list[str]:
    return [
        "--parts", PART, "parallel_key_a16x10x56", "--trials", "3", "--workers", "2",
        "--planner.n-candidates", "60",
    ]  # fmt: skip


def _assess_options(folder: Path) -> list[str]:
    path = folder / "bar.stl"
    trimesh.creation.box([70.0, 24.0, 18.0]).export(path)
    return [str(path), "--simulations", "72", "--trials", "1", "--workers", "1"]


def _trials(out: Path) -> dict[str, Any]:
    """Trials by part, condition, number and planner; a line that a kill has cut is none."""
    path = out / TRIALS
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    found = {}
    for line in lines:
        values = _without_times(json.loads(line))
        key = "-".join(str(values.get(name)) for name in ("part", "condition", "number", "planner"))
        assert key not in found, f"{key} is there twice"
        found[key] = values
    return found


def _assessed(out: Path) -> dict[str, Any]:
    """Trials, and the certified grasps of a run that has ended."""
    found, grasps = _trials(out), out / "grasps.json"
    return found | ({"grasps": grasps.read_text()} if (out / "report.html").exists() else {})


TIMES = ("planning_s", "seconds")


def _without_times(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: _without_times(one) for key, one in values.items() if key not in TIMES}
    return [_without_times(one) for one in values] if isinstance(values, list) else values


MODEL_FILES = ("model.safetensors", "model.json", "metrics.json", "card.md", "log.csv", "config.yaml")
RUN_FILES = ("report.html", "report.json", "config.yaml", "inputs.json", TRIALS)
PROGRAMS = {
    "train": Program("mskgrasp.train", _train_options, _trained, MODEL_FILES),
    "evaluate": Program("mskgrasp.evaluate", _evaluate_options, _trials, RUN_FILES),
    "assess": Program("mskgrasp.assess", _assess_options, _assessed, (*RUN_FILES, "grasps.json")),
}
