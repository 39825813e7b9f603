"""Folders of runs that are resumed."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml

from tests.inputs.row import Place, Row

PART = "hex_nut_m30"


def _run(program: str, name: str, files: dict[str, str], says: str, code: int = 1) -> Row:
    """A run into a folder that was begun by the same command, and damaged since."""

    def arguments(at: Place) -> list[str]:
        out = at.folder / "out"
        for file, content in files.items():
            at.file(f"out/{file}", content)
        more = [PART] if program == "assess" else ["--parts", PART]
        if program == "benchmark":
            more += ["--planners", "ours"]
        return [*more, "--out", str(out)]

    return Row(program, name, arguments, says, code)


def _other_data(at: Place) -> list[str]:
    """A model that was trained on one dataset, and another dataset."""
    from mskgrasp.train.config import TrainConfig
    from mskgrasp.train.run import run_training
    from tests.learning.small import PATCH

    out = at.shared / "trained"
    data = at.dataset()
    if not out.exists():
        stage = PATCH.gqn.model_copy(update={"epochs": 1})
        config = PATCH.model_copy(update={"gqn": stage, "gdn": stage})
        run_training(TrainConfig(**config.model_dump(), device="cpu", data=Path(data), out=out))
    shutil.copytree(out, at.folder / "model")
    at.shard("box_9", "box_9-0000.h5")
    return ["--config", str(at.folder / "model" / "config.yaml"), "--data", data, "--out", "model"]


def _replayed(content: bytes) -> Callable[[Place], list[str]]:
    """A stored trial whose file is something else."""

    def arguments(at: Place) -> list[str]:
        trial = dict(part="nut", number=0, seed=0, success=False, reason="missed", point_base=None)
        trial |= dict(predicted_std=None, measured=None)
        at.file("out/trials.jsonl", json.dumps(trial) + "\n")
        at.file("out/trials/nut-000.npz", content)
        return ["--replay", str(at.folder / "out"), "nut-000"]

    return arguments


def _objects() -> bytes:
    """An archive with an array of Python objects, which are stored as a pickle."""
    packed = io.BytesIO()
    np.savez(packed, schema_version=np.array([{}], dtype=object))
    return packed.getvalue()


BEGUN = yaml.safe_dump({})
ROWS = [
    _run(
        "evaluate",
        "a record of inputs cut off",
        {"config.yaml": BEGUN, "inputs.json": "{"},
        "inputs.json is not a record",
    ),
    _run(
        "palletize",
        "a record of inputs that is a list",
        {"config.yaml": BEGUN, "inputs.json": "[]"},
        "inputs.json is not a record|differ",
        1,
    ),
    _run(
        "assess",
        "an empty record of inputs",
        {"config.yaml": BEGUN, "inputs.json": ""},
        "inputs.json is not a record",
    ),
    _run(
        "benchmark",
        "a record of brackets",
        {"config.yaml": BEGUN, "inputs.json": "[" * 100_000},
        "inputs.json is not a record",
    ),
    _run(
        "evaluate",
        "settings that are no settings",
        {"config.yaml": "a: [", "inputs.json": "{}"},
        "config.yaml is not valid YAML",
        2,
    ),
    _run("evaluate", "trials without settings", {"trials.jsonl": "{}\n"}, "holds other files", 2),
    Row("train", "a folder trained on other data", _other_data, "other data", 2),
    Row(
        "evaluate",
        "a replayed trial that is no trial",
        lambda at: ["--replay", str(Path(at.file("out/trials.jsonl", "nonsense\n")).parent), "a-000"],
        "line 1 is not a trial",
        1,
    ),
    Row(
        "evaluate",
        "a replayed trial of brackets",
        lambda at: ["--replay", str(Path(at.file("out/trials.jsonl", "[" * 100_000 + "\n")).parent), "a-000"],
        "line 1 is not a trial",
        1,
    ),
    Row(
        "evaluate",
        "a trial's file that is no archive",
        _replayed(b"\x80\x04pickle"),
        "nut-000.npz is damaged .it is no archive",
        1,
    ),
    Row(
        "evaluate",
        "a trial's file that holds a pickle",
        _replayed(_objects()),
        "nut-000.npz is damaged .an array .* objects",
        1,
    ),
    Row("evaluate", "a trial's file cut off", _replayed(_objects()[:100]), "nut-000.npz is damaged", 1),
]
