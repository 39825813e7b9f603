"""Selection of CAD files by paths, folders and patterns."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.parts.importing.mesh_files import LOADERS


@dataclass(frozen=True, kw_only=True)
class Selected:
    """Files to import, refused paths and skipped files.

    Attributes:
        files: In the order of the arguments, those of a folder or pattern by name; none twice.
        refused: Path as given by the user, and the reason.
        skipped: Files in folders that are not CAD files by their suffix.
    """

    files: tuple[Path, ...]
    refused: tuple[tuple[Path, str], ...]
    skipped: tuple[Path, ...]


def select_files(arguments: Sequence[Path]) -> Selected:
    """Resolve files, folders (their files, not their subfolders') and quoted patterns (``**`` descends).

    A file may be a link where the user names it; in a folder or pattern a link out of it is refused, since
    the user has not named its target.
    """
    files: dict[str, Path] = {}
    refused: list[tuple[Path, str]] = []
    skipped: list[Path] = []
    for argument in arguments:
        if argument.is_dir():
            found, root = sorted(argument.iterdir()), argument
        elif glob.has_magic(str(argument)) and not argument.exists():
            found = sorted(Path(name) for name in glob.glob(str(argument), recursive=True))
            root = _fixed(argument)
            if not found:
                refused.append((argument, f"no file matches {argument}: check the path and the quotes"))
                continue
        elif not os.path.lexists(argument):
            refused.append((argument, f"there is no file or folder {argument}: check the path"))
            continue
        else:
            files.setdefault(os.path.abspath(argument), argument)
            continue
        before = len(files) + len(refused)
        for path in found:
            if path.suffix.lower() not in LOADERS or path.is_dir():
                skipped += [path] if not path.is_dir() else []
            elif path.is_symlink() and not path.exists():
                refused.append(
                    (path, f"{path} is a link to {os.readlink(path)}, which does not exist: correct the link")
                )
            elif not path.resolve().is_relative_to(root.resolve()):
                refused.append(
                    (
                        path,
                        f"{path} leads out of {root} to {path.resolve()}: give that path to import it",
                    )
                )
            else:
                files.setdefault(os.path.abspath(path), path)
        if len(files) + len(refused) == before and not any(os.path.abspath(path) in files for path in found):
            where = f"the folder {argument}" if argument.is_dir() else f"what matches {argument}"
            refused.append(
                (argument, f"{where} holds no CAD file ({', '.join(LOADERS)}): choose another, or use '**'")
            )
    return Selected(files=tuple(files.values()), refused=tuple(refused), skipped=tuple(skipped))


def _fixed(pattern: Path) -> Path:
    """The folders of a pattern before its first wildcard."""
    parts = []
    for part in pattern.parts[:-1]:
        if glob.has_magic(part):
            break
        parts.append(part)
    return Path(*parts)
