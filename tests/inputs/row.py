"""A malformed input, and what the program says of it."""

from __future__ import annotations

import importlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.torch import load_file, save_file

from mskgrasp.dataset import shard_path, write_shard
from mskgrasp.learning.grasp_models import DESCRIPTION, WEIGHTS, save_model
from mskgrasp.runtime.programs import PROGRAMS
from tests import synthetic
from tests.learning.small import small_models


@dataclass(frozen=True)
class Place:
    """An empty folder, the current one, in which a row makes what its program reads."""

    folder: Path
    shared: Path
    """A folder for what is made once for all rows, and not changed."""

    def file(self, name: str, content: str | bytes) -> str:
        """Write a file; its path."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    def config(self, content: str | bytes) -> list[str]:
        """The option that reads a configuration with this content."""
        return ["--config", self.file("config.yaml", content)]

    def model(self, weights: Callable[[dict[str, torch.Tensor]], Any] | None = None, **changes: Any) -> str:
        """A folder with a small model and a changed description; ``group__name`` is ``name`` in ``group``."""
        whole = self.shared / "model"
        if not whole.exists():
            save_model(whole, small_models())
        folder = self.folder / "model"
        shutil.copytree(whole, folder)
        values = json.loads((folder / DESCRIPTION).read_text())
        for key, value in changes.items():
            *groups, name = key.split("__")
            inner = values
            for group in groups:
                inner = inner[group]
            inner[name] = value
        (folder / DESCRIPTION).write_text(json.dumps(values))
        if weights is not None:
            stored = load_file(folder / WEIGHTS)
            weights(stored)
            save_file(stored, folder / WEIGHTS)
        return str(folder)

    def dataset(self, n_parts: int = 4) -> str:
        """A dataset of boxes that may be changed."""
        whole = self.shared / f"data-{n_parts}"
        if not whole.exists():
            synthetic.write_dataset(whole, n_parts=n_parts, n_attempts=40, seed=1)
        shutil.copytree(whole, self.folder / "data")
        return str(self.folder / "data")

    def shard(self, part: str, file: str) -> None:
        """Add a shard that says it is of a part under another file name."""
        attempts = synthetic.random_attempts(40, (0.05, 0.02, 0.03), np.random.default_rng(3))
        path = shard_path(self.folder / "data", "other", 0)
        write_shard(path, attempts, synthetic.info("other"))
        import h5py

        with h5py.File(path, "a") as shard:
            shard.attrs["part"] = part
        path.rename(path.with_name(file))


@dataclass(frozen=True)
class Row:
    """A malformed input.

    Attributes:
        program: As in `mskgrasp.runtime.programs.PROGRAMS`.
        name: What is wrong, in a few words.
        arguments: Makes the input and returns the command line.
        says: What the line on standard error contains, a regular expression.
        code: Exit code.
        also: More lines may precede it, where other files are imported all the same.
    """

    program: str
    name: str
    arguments: Callable[[Place], list[str]]
    says: str
    code: int = 2
    also: bool = False

    def main(self) -> Callable[[], int | None]:
        """The program."""
        return importlib.import_module(f"{PROGRAMS[self.program].module}.__main__").main
