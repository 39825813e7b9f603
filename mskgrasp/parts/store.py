"""Part folders, written atomically and checked when read."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.core.geometry import Pose
from mskgrasp.core.json_text import parse_json
from mskgrasp.parts.part import SCHEMA_VERSION, Part

FILES: tuple[str, ...] = ("mesh.ply", "hulls.glb", "part.json")
LEGAL_FOLDER = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
ORIGIN = "imported_from"
"""Key of ``part.json``: the file and options of an import."""

_UNPHYSICAL = ("content_hash", "recipe_hash", "source", "licence", ORIGIN)

_ABANDONED_S = 3600.0
"""Temporary folders older than this were left behind by a killed process."""

_TRIES = 10
_PAUSE_S = 0.02
"""Reading is tried again, after a pause, where another process replaces the folder: it takes milliseconds."""

_Read = TypeVar("_Read")

_FOLDER_OVERRIDE: ContextVar[Path | None] = ContextVar("folder_override", default=None)


@contextmanager
def kept_in(folder: Path) -> Iterator[None]:
    """Use another parts folder within the context."""
    token = _FOLDER_OVERRIDE.set(folder)
    try:
        yield
    finally:
        _FOLDER_OVERRIDE.reset(token)


def parts_folder() -> Path:
    """Folder of the stored parts: ``$XDG_CACHE_HOME/mskgrasp/parts`` or ``~/.cache/mskgrasp/parts``."""
    override = _FOLDER_OVERRIDE.get()
    if override is not None:
        return override
    base = os.environ.get("XDG_CACHE_HOME", "")
    # The XDG specification: a relative path is ignored.
    root = Path(base) if os.path.isabs(base) else Path.home() / ".cache"
    return root / "mskgrasp" / "parts"


def content_hash(mesh: bytes, hulls: bytes, record: dict[str, Any]) -> str:
    """Hex digest of all that determines a part's behaviour in a grasp: mesh, hulls and physical data."""
    physical = {
        key: value for key, value in record.items() if key not in _UNPHYSICAL and not key.startswith("hull_")
    }
    digest = hashlib.sha256()
    for block in (mesh, hulls, json.dumps(physical, sort_keys=True).encode()):
        digest.update(hashlib.sha256(block).digest())
    return digest.hexdigest()


def write_part(name: str, mesh: bytes, hulls: bytes, record: dict[str, Any]) -> Part:
    """Write a part to the parts folder under its name, replacing another part of that name.

    The files are written to a temporary folder that is renamed at the end. Where another process was faster
    with the same part, that one is kept.
    """
    record = record | {"content_hash": content_hash(mesh, hulls, record)}
    text = json.dumps(record, indent=1, sort_keys=True, ensure_ascii=False) + "\n"
    # The bytes of a file's name need not be UTF-8: what Python reads them as has an escape in JSON alone.
    encoded = text.encode(errors="backslashreplace")
    contents = dict(zip(FILES, (mesh, hulls, encoded), strict=True))
    return read_part(_put(parts_folder(), name, contents))


def pack_part(part: Part) -> dict[str, bytes]:
    """The files of a part by name, for sending to another machine."""
    return _read_steadily(part.folder, lambda: {name: _read(part.folder, name) for name in FILES})


def receive_part(name: str, digest: str, contents: Mapping[str, bytes]) -> Part:
    """Store the files of a part that another machine sent.

    They are written to the folder ``received`` beside the parts folder, under the part's name and hash: a
    part of the same name on this machine is not touched.

    Raises:
        BadPart: The files are not those of the part with this content hash.
    """
    folder = f"{name}-{digest[:16]}"
    root = parts_folder().with_name("received")
    if not LEGAL_FOLDER.fullmatch(folder) or set(contents) != set(FILES):
        raise BadPart(
            f"{name!r} with {', '.join(contents)} was received, which is not a part: check the sender"
        )
    try:
        part = read_part(root / folder)
        if part.content_hash == digest:
            return part
    except BadPart:
        pass  # not there yet, or damaged
    record = _record(root / folder, contents["part.json"])
    if content_hash(contents["mesh.ply"], contents["hulls.glb"], record) != digest:
        raise BadPart(
            f"part '{name}' arrived damaged: its files do not match the hash {digest[:16]}; try again"
        )
    return read_part(_put(root, folder, contents))


def _put(root: Path, name: str, contents: Mapping[str, bytes]) -> Path:
    root.mkdir(parents=True, exist_ok=True)
    _remove_abandoned(root)
    temporary = root / f".tmp-{name}-{uuid.uuid4().hex[:12]}"
    temporary.mkdir()
    try:
        for file_name, content in contents.items():
            with open(temporary / file_name, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        _replace_folder(temporary, root / name)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return root / name


def read_part(folder: Path | str) -> Part:
    """Read a part folder.

    Raises:
        BadPart: A file is missing, damaged, of another schema version, or a link out of the folder.
    """
    return read_part_and_record(Path(folder))[0]


def read_part_and_record(folder: Path) -> tuple[Part, dict[str, Any]]:
    """A part and all of its ``part.json``, of one state of the folder.

    Raises:
        BadPart: As in `read_part`.
    """
    return _read_steadily(folder, lambda: _read_all(folder))


def stored_recipe_hash(folder: Path) -> str | None:
    """Hash of the recipe that made a folder's part; None where there is no undamaged part."""
    try:
        return str(read_part_and_record(folder)[1].get("recipe_hash"))
    except BadPart:
        return None


def read_record(folder: Path) -> dict[str, Any]:
    """All of ``part.json``, with fields that Part lacks (``hull_error_p95``, ``hull_volume_ratio``, ...)."""
    return _read_steadily(folder, lambda: _record(folder, _read(folder, "part.json")))


def is_stored(folder: Path) -> bool:
    """Whether there is such a folder, also while another process replaces it."""
    for _ in range(_TRIES):
        if folder.is_dir() or not _is_moved_away(folder):
            break
        time.sleep(_PAUSE_S)
    return folder.is_dir()


def _read_steadily(folder: Path, read: Callable[[], _Read]) -> _Read:
    """What ``read`` gives; again where it fails and another process has replaced the folder meanwhile."""
    left = _TRIES
    while True:
        before, left = _state(folder), left - 1
        try:
            return read()
        except (BadPart, FileNotFoundError):
            if not left or (_state(folder) == before and not _is_moved_away(folder)):
                raise
        time.sleep(_PAUSE_S)


def _state(folder: Path) -> tuple[int, int] | None:
    """Changes where the folder is replaced; None where there is none."""
    try:
        status = folder.stat()
    except OSError:
        return None
    return status.st_ino, status.st_mtime_ns


def _is_moved_away(folder: Path) -> bool:
    """Whether another process has moved the folder away and not put another in its place yet."""
    if folder.exists():
        return False
    moved = re.compile(rf"\.tmp-{re.escape(folder.name)}-[0-9a-f]{{12}}-\d+-old")
    try:
        return any(
            moved.fullmatch(one.name) and time.time() - one.stat().st_ctime < _TRIES * _PAUSE_S
            for one in folder.parent.iterdir()
        )
    except OSError:  # of that, too, it is taken away meanwhile
        return folder.parent.is_dir()


def _read_all(folder: Path) -> tuple[Part, dict[str, Any]]:
    contents = {name: _read(folder, name) for name in FILES}
    record = _record(folder, contents["part.json"])
    if record.get("schema_version") != SCHEMA_VERSION:
        raise BadPart(
            f"{folder / 'part.json'} has schema version {record.get('schema_version')!r}, "
            f"this program reads {SCHEMA_VERSION}: build or import the part again"
        )
    try:
        part = _part_of(folder, record)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"key {error} is missing" if isinstance(error, KeyError) else str(error).splitlines()[0]
        raise BadPart(f"{folder / 'part.json'} is damaged ({what}): {_REMEDY}") from error
    if content_hash(contents["mesh.ply"], contents["hulls.glb"], record) != part.content_hash:
        raise BadPart(f"{folder}: the files do not match the hash in part.json: {_REMEDY}")
    return part, record


_REMEDY = "delete the folder, then build or import the part again"


def _replace_folder(temporary: Path, final: Path) -> None:
    moved_away: list[Path] = []
    try:
        for attempt in range(20):
            try:
                os.rename(temporary, final)
                return
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                    raise
            if _holds_the_same(final, temporary):
                return
            old = temporary.with_name(f"{temporary.name}-{attempt}-old")
            try:
                os.rename(final, old)
            except FileNotFoundError:
                continue
            moved_away.append(old)
    finally:  # not before: until the new one is in its place, readers find none
        for old in moved_away:
            if old.is_dir():
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.unlink()
    raise BadPart(f"{final} keeps being replaced by another process: run one build at a time")


def _holds_the_same(folder: Path, other: Path) -> bool:
    """Whether a folder holds an undamaged part with the record of another's."""
    try:
        read_part(folder)
        return _read(folder, "part.json") == _read(other, "part.json")
    except BadPart:
        return False


def _remove_abandoned(root: Path) -> None:
    for folder in root.glob(".tmp-*"):
        try:
            if time.time() - folder.stat().st_mtime > _ABANDONED_S:
                shutil.rmtree(folder, ignore_errors=True)
        except FileNotFoundError:
            continue


def _read(folder: Path, name: str) -> bytes:
    path = folder / name
    if not path.is_file():
        kind = BadPart if (folder / "part.json").is_file() else UnknownPart
        raise kind(
            f"{folder} is not a part folder: {name} is missing; name a part (python -m mskgrasp.parts list), "
            f"a CAD file, or a folder with {', '.join(FILES)}"
        )
    if not path.resolve().is_relative_to(folder.resolve()):
        raise BadPart(f"{path} leads out of its folder to {path.resolve()}: {_REMEDY}")
    return path.read_bytes()


def _record(folder: Path, text: bytes) -> dict[str, Any]:
    try:
        record = parse_json(text)
    except ValueError as error:
        raise BadPart(f"{folder / 'part.json'} is damaged (not JSON): {_REMEDY}") from error
    if not isinstance(record, dict):
        raise BadPart(f"{folder / 'part.json'} is damaged (not a JSON object): {_REMEDY}")
    return record


def _part_of(folder: Path, record: dict[str, Any]) -> Part:
    probability = _array(record, "resting_probability", (-1,))
    count = len(probability)
    if count < 1 or not np.isclose(probability.sum(), 1.0, atol=1e-6) or (probability < 0).any():
        raise ValueError("resting_probability does not sum to 1")
    name = _text(record, "name")
    if not LEGAL_FOLDER.fullmatch(name):  # pictures and folders are named after it
        raise ValueError(f"the name {name!r} is not legal")
    return Part(
        name=name,
        folder=folder,
        family=_text(record, "family"),
        source=_text(record, "source"),
        licence=_text(record, "licence"),
        dimensions={str(key): float(value) for key, value in record["dimensions"].items()},
        content_hash=_text(record, "content_hash"),
        density=_positive(record, "density"),
        mass=_positive(record, "mass"),
        inertia=_array(record, "inertia", (3, 3)),
        principal_inertia=_array(record, "principal_inertia", (3,)),
        quat_obj_principal=_unit(_array(record, "quat_obj_principal", (4,))),
        extents=_array(record, "extents", (3,)),
        longest_axis=_positive(record, "longest_axis"),
        n_hulls=int(_positive(record, "n_hulls")),
        hulls_volume=_positive(record, "hulls_volume"),
        hull_error=_finite(record, "hull_error"),
        hull_error_p95=_finite(record, "hull_error_p95"),
        hull_volume_ratio=_positive(record, "hull_volume_ratio"),
        resting=Pose(
            position=_array(record["resting"], "position", (count, 3)),
            quat_wxyz=_unit(_array(record["resting"], "quat_wxyz", (count, 4))),
        ),
        resting_probability=probability / probability.sum(),
    )


def _text(record: dict[str, Any], key: str) -> str:
    if not isinstance(record[key], str):
        raise ValueError(f"{key} is not a string")
    return record[key]


def _finite(record: dict[str, Any], key: str) -> float:
    value = float(record[key])
    if not (np.isfinite(value) and value >= 0):
        raise ValueError(f"{key} is {value}, it must be finite and not negative")
    return value


def _positive(record: dict[str, Any], key: str) -> float:
    value = float(record[key])
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{key} is {value}, it must be positive")
    return value


def _array(record: dict[str, Any], key: str, shape: tuple[int, ...]) -> np.ndarray:
    array = np.asarray(record[key], dtype=np.float64)
    expected = tuple(len(array) if size == -1 and array.ndim else size for size in shape)
    if array.shape != expected or not np.isfinite(array).all():
        raise ValueError(f"{key} has shape {array.shape}, the legal shape is {shape} with finite numbers")
    array.flags.writeable = False  # a Part is shared between its users
    return array


def _unit(quat: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(quat, axis=-1, keepdims=True)
    if not np.allclose(length, 1.0, atol=1e-6):
        raise ValueError("a quaternion is not of unit length")
    return quat / length
