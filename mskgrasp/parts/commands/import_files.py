"""Parallel import of CAD files; a file that cannot be imported stops no other."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from mskgrasp.core.errors import BadPart, MskgraspError
from mskgrasp.parts import store
from mskgrasp.parts.names import legal_name
from mskgrasp.runtime.worker_pool import Work, results

if TYPE_CHECKING:
    from mskgrasp.core.units import Unit
    from mskgrasp.parts.importing.bodies import Bodies
    from mskgrasp.parts.importing.import_file import Imported

_NUMBERED = re.compile(r"(-\d+)+$")
_LOST = (
    "ended the process that imported it, twice: memory was short, or a library crashed; free memory, or "
    "export it coarser"
)


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Options of an import, as those of `mskgrasp.parts.importing.import_file`."""

    name: str | None
    family: str
    unit: Unit | None
    density: float
    licence: str
    bodies: Bodies


@dataclass(frozen=True, kw_only=True)
class FileResult:
    """Outcome for one file.

    Attributes:
        path: Path of the file.
        imported: Its parts; None where the file was refused.
        reason: Reason of the refusal, with the file's path; empty where it was imported.
        replaced: Whether a part of that name was there before.
    """

    path: Path
    imported: Imported | None
    reason: str = ""
    replaced: bool = False


@dataclass(frozen=True, kw_only=True)
class _Group:
    """Files whose parts may have the same name, which one process imports in turn; processes lost so far."""

    files: tuple[Path, ...]
    lost: int = 0


def import_files(files: Sequence[Path], options: ImportOptions, workers: int) -> Generator[FileResult]:
    """Import files and yield their results as they finish; close the iterator to stop early.

    The parts are the same whatever the number of processes. Of files with one name the first is imported.

    Args:
        files: CAD files, none twice.
        options: Options of all.
        workers: Processes.

    Raises:
        WorkerFailed: The disk is full, or a process failed for a reason that no file is to blame for.
    """
    missing = dict.fromkeys(files)
    work = Work(
        _importer,
        (store.parts_folder(), options),
        name=lambda group: str(group.files[0]),
        rest=_rest,
    )
    # Apart also where there is only one: what ends its process must not end this one.
    for result in results(work, _groups(files, options), max(1, workers), apart=True):
        del missing[result.path]
        yield result
    for path in missing:
        yield FileResult(path=path, imported=None, reason=f"{path} {_LOST}")


def _groups(files: Sequence[Path], options: ImportOptions) -> list[_Group]:
    groups: dict[str, list[Path]] = {}
    for path in files:
        groups.setdefault(_key(path, options), []).append(path)
    return [_Group(files=tuple(group)) for group in groups.values()]


def _key(path: Path, options: ImportOptions) -> str:
    """Shared by files whose parts may have the same name."""
    try:
        name = legal_name(path.stem if options.name is None else options.name)
    except BadPart:
        return ""  # refused when it is imported
    # Parts of a split file end in numbers, before which a long name is cut off.
    return _NUMBERED.sub("", name)[:60] if options.bodies == "split" else name


def _rest(group: _Group, n_results: int) -> _Group | None:
    """The files of a group that a lost process has left: without the first where it cost two processes."""
    lost = 1 if n_results else group.lost + 1
    files = group.files[n_results:]
    if lost > 1:
        files, lost = files[1:], 0
    return replace(group, files=files, lost=lost) if files else None


@contextmanager
def _importer(
    settings: tuple[Path, ImportOptions],
) -> Iterator[Callable[[_Group], Iterator[FileResult]]]:
    folder, options = settings
    with store.kept_in(folder):
        yield partial(_import_group, options)


def _import_group(options: ImportOptions, group: _Group) -> Iterator[FileResult]:
    taken: dict[str, Path] = {}
    for path in group.files:
        yield _import_one(path, options, taken)


def _import_one(path: Path, options: ImportOptions, taken: dict[str, Path]) -> FileResult:
    # The readers take a while to load, which the process that only waits need not do.
    from mskgrasp.parts.importing.import_file import import_file

    replaced: list[str] = []
    try:
        imported = import_file(
            path,
            name=options.name,
            family=options.family,
            unit=options.unit,
            density=options.density,
            licence=options.licence,
            bodies=options.bodies,
            check_name=partial(_check_name, taken, path, replaced),
        )
    except MskgraspError as error:
        return FileResult(path=path, imported=None, reason=str(error))
    except MemoryError:
        return FileResult(
            path=path, imported=None, reason=f"{path} needs more memory: free some, or export it coarser"
        )
    except OSError:
        raise  # the disk's fault, not the file's, as `read_content` has read that
    except Exception as error:  # libraries raise exceptions of many types; the other files are imported
        what = " ".join([f"{type(error).__name__}:", *str(error).splitlines()[:1]])
        reason = f"{path} could not be imported ({what[:200]}): a defect of mskgrasp, report it with the file"
        return FileResult(path=path, imported=None, reason=reason)
    taken |= {part.name: path for part in imported.parts}
    return FileResult(path=path, imported=imported, replaced=bool(replaced))


def _check_name(taken: dict[str, Path], path: Path, replaced: list[str], name: str) -> None:
    """Refuse the name of a part that an earlier file was imported as; note one of an older part."""
    if name in taken:
        raise BadPart(f"{path} would replace the part {name!r} of {taken[name]}: import it with --name")
    if (store.parts_folder() / name).is_dir():
        replaced.append(name)
