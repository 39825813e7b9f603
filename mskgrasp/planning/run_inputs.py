"""Digests of the inputs of a run: cell file, model, parts, certified grasps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from hal.camera_calibration import calibration_path
from mskgrasp.core.config import read_yaml
from mskgrasp.core.files import write_whole
from mskgrasp.parts import Part, find_part
from mskgrasp.planning.certified import FILE, certified_folder
from mskgrasp.runtime.run_folder import file_digest, record_inputs

BY_CONTENT = ("models", "cell")
"""Settings that name files: a run goes on with equal files in another place, so that only digests count."""


def inputs_of(cell: Path, models: Path, parts: Iterable[str]) -> dict[str, str]:
    """Compute digests of a cell's file and its calibration, a model and parts."""
    digests = {"cell": file_digest(cell)} | calibration_digest(cell)
    return digests | model_digests(models) | part_digests(parts)


def calibration_digest(cell: Path) -> dict[str, str]:
    """Compute the digest of the calibration that a cell's file names; empty where there is none."""
    camera = read_yaml(cell).get("camera")
    name = camera.get("calibration") if isinstance(camera, dict) else None
    path = calibration_path(name, cell) if isinstance(name, str) else None
    # One that is missing is refused, with the remedy, when the camera is connected.
    return {"calibration": file_digest(path)} if path is not None and path.is_file() else {}


def model_digests(models: Path, label: str = "") -> dict[str, str]:
    """Compute digests of a model's files; the label distinguishes models."""
    return {
        f"{label} {name}".strip(): file_digest(models / name) for name in ("model.json", "model.safetensors")
    }


def part_digests(parts: Iterable[str]) -> dict[str, str]:
    """Compute digests of parts, given by name or folder; a part is recorded by its name."""
    found = [find_part(part) for part in parts]
    return {f"part {part.name}": part.content_hash for part in found}


def certified_digests(parts: Iterable[str]) -> dict[str, str]:
    """Compute digests of the certified grasps, in the cache, of parts given by name or folder.

    Raises:
        UsageError: A part has none.
    """
    found = [find_part(part) for part in parts]
    return {f"certified grasps of {part.name}": file_digest(certified_folder(part) / FILE) for part in found}


def keep_certified(out: Path, parts: Sequence[str]) -> None:
    """Copy the certified grasps of parts from the cache, which may change, to the folder of a run.

    Raises:
        UsageError: The run was begun with others.
    """
    record_inputs(out, certified_digests(parts))
    for part in map(find_part, parts):
        kept = kept_certified(out, part)
        kept.mkdir(parents=True, exist_ok=True)
        write_whole(kept / FILE, (certified_folder(part) / FILE).read_bytes())


def kept_certified(out: Path, part: Part) -> Path:
    """Folder in a run's folder for the certified grasps of a part, as `keep_certified` writes it."""
    return out / "certified" / part.name
