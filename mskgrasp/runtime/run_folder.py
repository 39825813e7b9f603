"""Folder of a run of trials, which stores every trial at once and can be resumed with the same inputs."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from mskgrasp.core.config import Config, read_config, write_config
from mskgrasp.core.errors import BadConfig, BadDataset, UsageError
from mskgrasp.core.files import exclusive_lock, is_leftover, write_whole
from mskgrasp.core.json_text import parse_json
from mskgrasp.runtime.cli import make_folder

RecordT = TypeVar("RecordT")
SETTINGS = "config.yaml"
INPUTS = "inputs.json"
TRIALS = "trials.jsonl"
_SCENE_VERSION = "scene_version"


@contextmanager
def opened_run(
    config: Config,
    out: Path,
    inputs: Mapping[str, str],
    *,
    scene_version: int,
    may_change: Collection[str],
) -> Iterator[None]:
    """Open the folder of a run, locked until the end of the block.

    The folder is new, or of a run that was started with the same settings, inputs and scenes.

    Args:
        config: Settings of the run.
        out: The folder.
        inputs: Digests of the files and parts that the results depend on, by their names in messages.
        scene_version: Version of the formula that draws the scenes from the seed; 1 for a folder without one.
        may_change: Names of settings that may differ when a run is resumed.

    Raises:
        UsageError: The folder holds another run or other files, or another process writes to it.
        BadDataset: The record of the folder's inputs is damaged.
    """
    _compatible_inputs(config, out, inputs, scene_version, may_change)
    make_folder(out)
    with exclusive_lock(out) as alone:
        if not alone:
            raise UsageError(f"another run is writing to {out}; wait for it, or choose another --out")
        # Once more: another run may have begun here since.
        known = _compatible_inputs(config, out, inputs, scene_version, may_change)
        for leftover in out.glob("*.tmp"):
            leftover.unlink()
        record = known | dict(inputs) | {_SCENE_VERSION: scene_version}
        write_whole(out / INPUTS, (json.dumps(record, indent=1) + "\n").encode())
        write_config(config, out / SETTINGS)  # last: with it, the run has begun
        yield


def _compatible_inputs(
    config: Config, out: Path, inputs: Mapping[str, str], scene_version: int, may_change: Collection[str]
) -> dict[str, Any]:
    """The inputs recorded in a folder, with which the run is compatible; none for a new folder."""
    settings, fingerprint = out / SETTINGS, out / INPUTS
    if settings.exists() and fingerprint.exists():
        try:
            before = read_config(type(config), settings)
        except BadConfig as error:
            raise UsageError(
                f"--out {out} holds another program's run, or one of another version ({error}); choose "
                "another"
            ) from error
        changed = [
            name
            for name in type(config).model_fields
            if name not in may_change and getattr(before, name) != getattr(config, name)
        ]
        known = _read_inputs(fingerprint)
        _refuse(out, [*changed, *_changed(known, inputs)])
        stored = known.get(_SCENE_VERSION, 1)
        if stored != scene_version:
            raise UsageError(
                f"{out} has scenes of version {stored}, this program draws version {scene_version}: the same "
                "seed places parts differently; choose another --out"
            )
        return known
    # A run that was killed as it began has left its inputs at most.
    if out.is_dir() and not all(is_leftover(path) or path.name == INPUTS for path in out.iterdir()):
        raise UsageError(f"--out {out} holds other files; choose a new folder")
    return {}


def record_inputs(out: Path, inputs: Mapping[str, str]) -> None:
    """Record inputs of an opened run that are known only once it has begun.

    Args:
        out: The folder, within the block of `opened_run`.
        inputs: As there.

    Raises:
        UsageError: The folder holds a run with others.
    """
    known = _read_inputs(out / INPUTS)
    _refuse(out, _changed(known, inputs))
    write_whole(out / INPUTS, (json.dumps(known | dict(inputs), indent=1) + "\n").encode())


def _changed(known: Mapping[str, Any], inputs: Mapping[str, str]) -> list[str]:
    return [name for name, value in inputs.items() if known.get(name, value) != value]


def _refuse(out: Path, changed: Collection[str]) -> None:
    if changed:
        raise UsageError(
            f"{out} was started with other inputs ({', '.join(changed)} differ); choose another --out"
        )


def _read_inputs(path: Path) -> dict[str, Any]:
    try:
        known = parse_json(path.read_bytes())
    except ValueError:
        known = None
    if not isinstance(known, dict):
        raise BadDataset(f"{path} is not a record of a run's inputs; choose another --out")
    return known


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
    """Append a line to a file of trials; NaN is refused, since JSON has none.

    Raises:
        OSError: The disk is full; `resume_trials` removes what was written of the line.
    """
    line = json.dumps(values, allow_nan=False) + "\n"
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(line)
    except OSError as error:  # of writing, it does not name the file
        raise OSError(error.errno, error.strerror, str(path)) from error


def rewrite_trials(path: Path, lines: Iterable[Mapping[str, Any]]) -> None:
    """Replace a file of trials atomically."""
    write_whole(path, "".join(json.dumps(one, allow_nan=False) + "\n" for one in lines).encode())


def read_trials(path: Path, make: Callable[[dict[str, Any]], RecordT]) -> list[RecordT]:
    """Read the stored trials in order; an incomplete last line, which is being written, is left out.

    Raises:
        BadDataset: A line of the file is not a trial.
    """
    return _read_trials(path, make)[0]


def resume_trials(path: Path, make: Callable[[dict[str, Any]], RecordT]) -> list[RecordT]:
    """Read the trials of a run that this process has opened; remove an incomplete last line.

    A killed run leaves such a line. Only the process that holds the run's lock may remove it: to any other
    it may be a line that is being written.

    Raises:
        BadDataset: A line of the file is not a trial.
    """
    found, n_incomplete = _read_trials(path, make)
    if n_incomplete:
        os.truncate(path, path.stat().st_size - n_incomplete)
    return found


def _read_trials(path: Path, make: Callable[[dict[str, Any]], RecordT]) -> tuple[list[RecordT], int]:
    """The trials, and the number of bytes of an incomplete last line."""
    if not path.exists():
        return [], 0
    *lines, incomplete = path.read_bytes().split(b"\n")
    found = []
    for i, line in enumerate(lines):
        try:
            found.append(make(parse_json(line)))
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise BadDataset(
                f"{path}: line {i + 1} is not a trial; delete it or choose another --out"
            ) from error
    return found, len(incomplete)
