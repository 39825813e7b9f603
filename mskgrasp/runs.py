"""A run of trials in a folder: begun with certain inputs, every trial stored at once, gone on with later."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from mskgrasp.cli import make_folder
from mskgrasp.config import Config, read_config, write_config
from mskgrasp.errors import BadDataset, UsageError
from mskgrasp.files import write_whole
from mskgrasp.parts import chosen_names, find_part, starter_names

Record = TypeVar("Record")
SETTINGS = "config.yaml"
INPUTS = "inputs.json"
TRIALS = "trials.jsonl"


def begin(config: Config, out: Path, inputs: Mapping[str, str], *, may_change: Collection[str]) -> None:
    """Opens the folder of a run: new, or begun with the same settings and inputs.

    Args:
        config: Of the run.
        out: The folder.
        inputs: Digest of each file and part that the results depend on, by a name for messages.
        may_change: Settings that a run goes on with, whatever they were.

    Raises:
        UsageError: It holds something else.
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
                f"{out} was begun with other inputs ({', '.join(changed)} differ); choose another --out"
            )
        inputs = known | dict(inputs)
    elif out.is_dir() and any(out.iterdir()):
        raise UsageError(f"--out {out} holds other files; choose a new folder")
    make_folder(out)
    write_config(config, settings)
    fingerprint.write_text(json.dumps(dict(inputs), indent=1) + "\n", encoding="utf-8")


def inputs_of(cell: Path, models: Path, parts: Iterable[str]) -> dict[str, str]:
    """Digests of a cell's file, a model and parts."""
    return {"cell": file_digest(cell)} | model_digests(models) | part_digests(parts)


def model_digests(models: Path, label: str = "") -> dict[str, str]:
    """Digests of a model's files; the label tells models apart."""
    return {
        f"{label} {name}".strip(): file_digest(models / name) for name in ("model.json", "model.safetensors")
    }


def part_digests(parts: Iterable[str]) -> dict[str, str]:
    """Digests of parts, by name or folder."""
    return {f"part {name}": find_part(name).content_hash for name in parts}


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises:
        UsageError: It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error


def append(path: Path, values: Mapping[str, Any]) -> None:
    """Adds a line to a file of trials; NaN is no JSON and refused."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(values, allow_nan=False) + "\n")


def rewrite(path: Path, lines: Iterable[Mapping[str, Any]]) -> None:
    """Writes a file of trials anew, whole or not at all."""
    write_whole(path, "".join(json.dumps(one, allow_nan=False) + "\n" for one in lines).encode())


def read(path: Path, make: Callable[[dict[str, Any]], Record]) -> list[Record]:
    """Trials already done, in order; a last line cut short by a kill is dropped from the file.

    Raises:
        BadDataset: The file holds something else.
    """
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")
    found = []
    for i, line in enumerate(lines[:-1]):
        try:
            found.append(make(json.loads(line)))
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise BadDataset(
                f"{path}: line {i + 1} is no trial; delete it or choose another --out"
            ) from error
    if lines[-1]:
        path.write_text("\n".join(lines[:-1]) + ("\n" if len(lines) > 1 else ""), encoding="utf-8")
    return found


def part_names(words: Iterable[str], training: Mapping[str, Any], n_parts: int = 0) -> list[str]:
    """Names or folders of parts from a user's words.

    ``train``, ``validation`` and ``test``: the model's, where it was trained with any such; else the
    catalogue's, for the last two without what the model was trained on. ``all``: every part of the starter
    set. Other words as `mskgrasp.parts.chosen_names`.

    Args:
        words: Of the user.
        training: What a model says of its training.
        n_parts: Over 0, at most so many, an equal share of each word's, evenly chosen from their names in
            order; more of them include the fewer.

    Raises:
        BadPart: A part is unknown.
    """
    sets = []
    for word in words:
        known = training.get("training_parts") or ()
        if word == "train" and known:
            sets.append(list(known))
        elif word in ("validation", "test"):
            unseen = training.get(f"{word}_parts")
            sets.append(unseen or [name for name in chosen_names((word,)) if name not in known])
        else:
            sets.append(starter_names() if word == "all" else chosen_names((word,)))
    if n_parts:
        sets = [evenly(list(one), share) for one, share in zip(sets, _shares(sets, n_parts), strict=True)]
    names = list(dict.fromkeys(name for one in sets for name in one))
    for name in names:
        find_part(name)
    return names


def evenly(names: Sequence[str], n: int) -> list[str]:
    """At most n of some names, spread evenly over their sorted order; a larger n adds to a smaller one's."""
    in_order = sorted(names)
    # The golden ratio's multiples fill an interval evenly, however many there are.
    places = (k * 0.6180339887498949 % 1.0 for k in itertools.count())
    chosen: dict[int, None] = {}
    while len(chosen) < min(n, len(in_order)):
        chosen[int(next(places) * len(in_order))] = None
    return [in_order[i] for i in sorted(chosen)]


def _shares(sets: Sequence[Sequence[str]], n: int) -> list[int]:
    """How many of each set, n in all where there are so many; what a small one lacks the others give."""
    shares = [0] * len(sets)
    while sum(shares) < min(n, sum(map(len, sets))):
        open_ = [i for i, one in enumerate(sets) if shares[i] < len(one)]
        shares[min(open_, key=lambda i: shares[i])] += 1
    return shares
