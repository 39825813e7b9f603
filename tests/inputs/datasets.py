"""Datasets, and the folders of trainings."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import h5py

from tests.inputs.row import Place, Row

Change = Callable[[Place, Path], object]
"""Damages the shards in a folder."""


def _train(change: Change, says: str, name: str, code: int = 1) -> Row:
    def arguments(at: Place) -> list[str]:
        data = at.dataset()
        change(at, Path(data, "shards"))
        return ["--data", data, "--out", "model"]

    return Row("train", name, arguments, says, code)


def _card(change: Change, says: str, name: str) -> Row:
    def arguments(at: Place) -> list[str]:
        data = at.dataset()
        change(at, Path(data, "shards"))
        return ["card", data]

    return Row("dataset", name, arguments, says, 1)


def _attribute(name: str, value: object) -> Change:
    def change(at: Place, shards: Path) -> None:
        with h5py.File(shards / "box_0-0000.h5", "a") as file:
            file.attrs[name] = value

    return change


def _huge(at: Place, shards: Path) -> None:
    with h5py.File(shards / "box_0-0000.h5", "a") as file:
        del file["grasp"]
        file.create_dataset("grasp", (2**40, 4), "f4", chunks=(1024, 4))


def _elsewhere(at: Place, shards: Path) -> None:
    with h5py.File(shards / "box_0-0000.h5", "a") as file:
        del file["grasp"]
        file["grasp"] = h5py.ExternalLink(str(shards / "box_1-0000.h5"), "/grasp")


def _cut(at: Place, shards: Path) -> None:
    path = shards / "box_0-0000.h5"
    path.write_bytes(path.read_bytes()[:5000])


ROWS = [
    _train(
        lambda at, shards: shutil.copy(shards / "box_0-0000.h5", shards / "box_0-0001.h5"),
        "box_0-0001.h5.*box_0-0000.h5",
        "a shard twice",
    ),
    _train(
        lambda at, shards: at.shard("../../../x", "evil-0000.h5"),
        r"'../../../x'",
        "a part with a path for a name",
    ),
    _train(
        lambda at, shards: at.shard("box_9", "box_8-0000.h5"), "box_8-0000.h5", "a shard under another name"
    ),
    _train(_cut, "is damaged", "a shard cut off"),
    _train(_huge, "claims the shape", "an array of a terabyte"),
    _train(_elsewhere, "another file", "an array in another file"),
    _train(_attribute("schema_version", 99), "schema version 99, legal: 1 to 3", "a shard of another schema"),
    _train(
        _attribute("intrinsics", [float("nan")] * 9),
        "calibration is not finite",
        "a camera that is no camera",
    ),
    _train(_attribute("physics", "{"), "is damaged", "physics that are no JSON"),
    _train(_attribute("physics", "[" * 100_000), "is damaged", "physics of brackets"),
    _train(
        lambda at, shards: at.file("data/shards/box_7-0000.h5", "hello"), "no HDF5 file", "a text as a shard"
    ),
    _card(_cut, "is damaged", "a shard cut off"),
    Row(
        "dataset",
        "a file as a dataset",
        lambda at: ["check", at.file("data", "")],
        "is a file; give the folder",
    ),
    Row("dataset", "a folder without shards", lambda at: ["check", str(at.folder)], "has no folder shards"),
    Row(
        "dataset",
        "an export into an existing file",
        lambda at: ["export", at.dataset(), "--format", "npz", "--out", at.file("a.npz", "")],
        "a.npz",
        2,
    ),
    Row(
        "dataset",
        "an export with another suffix",
        lambda at: ["export", at.dataset(), "--format", "npz", "--out", "a.zip"],
        r"a.zip.*\.npz",
    ),
    Row(
        "collect",
        "a dataset with broken settings",
        lambda at: [
            "--out",
            str(Path(at.file("data/config.yaml", "parts: [")).parent),
            "--parts",
            "hex_nut_m30",
        ],
        "choose another --out",
    ),
    Row(
        "evaluate",
        "LOWESS of no dataset",
        lambda at: [
            "--experiment",
            "displacement",
            "--lowess-data",
            "no",
            "--parts",
            "hex_nut_m30",
            "--planner.policy",
            "quality",
        ],
        "no dataset folder no",
    ),
]
