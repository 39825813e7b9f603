"""Folder of a run of trials, which stores every trial at once and can be resumed with the same inputs."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from mskgrasp.core.config import Config, read_config, write_config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.runtime.cli import make_folder

Record = TypeVar("Record")
SETTINGS = "config.yaml"
INPUTS = "inputs.json"
TRIALS = "trials.jsonl"


def open_run_folder(
    config: Config, out: Path, inputs: Mapping[str, str], *, may_change: Collection[str]
) -> None:
    """Opens the folder of a run: a new one, or one that was started with the same settings and inputs.

    Args:
        config: Settings of the run.
        out: The folder.
        inputs: Digests of the files and parts that the results depend on, by their names in messages.
        may_change: Names of settings that may differ when a run is resumed.

    Raises:
        UsageError: The folder holds another run, or other files.
    """
    settings, fingerprint = out / SETTINGS, out / INPUTS
    if settings.exists() and fingerprint.exists():
        before = read_config(type(config), settings)
        changed = [
            name
            for name in type(config).model_fields
            if name not in may_change and getattr(before, name) != getattr(config, name)
        ]
        known = json.loads(fingerprint.read_text(encoding="utf-8"))
        changed += [name for name, value in inputs.items() if known.get(name, value) != value]
        if changed:
            raise UsageError(
                f"{out} was started with other inputs ({', '.join(changed)} differ); choose another --out"
            )
        inputs = known | dict(inputs)
    elif out.is_dir() and any(out.iterdir()):
        raise UsageError(f"--out {out} holds other files; choose a new folder")
    make_folder(out)
    write_config(config, settings)
    write_whole(fingerprint, (json.dumps(dict(inputs), indent=1) + "\n").encode())


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises:
        UsageError: The file cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error


def append_trial(path: Path, values: Mapping[str, Any]) -> None:
    """Appends a line to a file of trials; NaN is refused, since JSON has none."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(values, allow_nan=False) + "\n")


def rewrite_trials(path: Path, lines: Iterable[Mapping[str, Any]]) -> None:
    """Replaces a file of trials atomically."""
    write_whole(path, "".join(json.dumps(one, allow_nan=False) + "\n" for one in lines).encode())


def read_trials(path: Path, make: Callable[[dict[str, Any]], Record]) -> list[Record]:
    """Reads the stored trials in order; removes an incomplete last line, which a killed run leaves.

    Raises:
        BadDataset: A line of the file is not a trial.
    """
    if not path.exists():
        return []
    *lines, incomplete = path.read_bytes().split(b"\n")
    found = []
    for i, line in enumerate(lines):
        try:
            found.append(make(json.loads(line)))
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise BadDataset(
                f"{path}: line {i + 1} is not a trial; delete it or choose another --out"
            ) from error
    if incomplete:
        os.truncate(path, path.stat().st_size - len(incomplete))
    return found
