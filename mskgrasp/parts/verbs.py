"""What ``python -m mskgrasp.parts`` can do: build, import, list, show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, assert_never

import tyro
from rich.console import Console
from rich.table import Table

from mskgrasp.errors import BadPart, UsageError
from mskgrasp.parts import store
from mskgrasp.parts.build import build_part, builtin_names, find_part, imported_names, is_built, unknown_part
from mskgrasp.parts.terminal import progress_bar
from mskgrasp.parts.verb_import import Import, run_import

PROG = "python -m mskgrasp.parts"
PICTURE_SUFFIXES = (".png", ".svg", ".pdf")


@dataclass(frozen=True, kw_only=True)
class Build:
    """Build built-in parts: all of them, or those named. Parts that are up to date are left alone.

    A part is ready in about half a second. Example: python -m mskgrasp.parts build hex_nut_m20 washer_m36
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Names as `list` shows them; none means all."""


@dataclass(frozen=True, kw_only=True)
class List:
    """List all parts: built in and imported, with size, mass and quality of the hulls."""


@dataclass(frozen=True, kw_only=True)
class Show:
    """Draw a part: its mesh, its collision hulls moved apart, and how it comes to rest on a table.

    Example: python -m mskgrasp.parts show spur_gear_m2_z18 --out gear.png
    """

    name: tyro.conf.Positional[str]
    """A part's name, or the path of a part folder."""
    out: Path | None = None
    """Picture to write, .png, .svg or .pdf; by default NAME.png in the current folder."""


Verb = (
    Annotated[Build, tyro.conf.subcommand("build")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Show, tyro.conf.subcommand("show")]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one verb; returns the exit code."""
    verb = tyro.cli(
        Verb,  # pyright: ignore[reportArgumentType]
        prog=PROG,
        description=f"Parts for simulation: {len(builtin_names())} built in, and your own CAD meshes.",
        args=None if argv is None else list(argv),
    )
    match verb:
        case Build():
            return _build(verb)
        case Import():
            return run_import(verb)
        case List():
            return _list()
        case Show():
            return _show(verb)
        case _:
            assert_never(verb)


def _build(verb: Build) -> int:
    known = builtin_names()
    for name in verb.names:
        if name not in known:
            raise unknown_part(name, builtin_only=True)
    names = tuple(dict.fromkeys(verb.names)) or known
    fresh = 0
    with progress_bar() as progress:
        task = progress.add_task("", total=len(names))
        for name in names:
            progress.update(task, description=name)
            fresh += not is_built(name)
            build_part(name)
            progress.advance(task)
    print(f"{len(names)} parts ready, {fresh} built now, in {store.parts_folder()}")
    return 0


def _list() -> int:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for header in ("name", "family", "source"):
        table.add_column(header, no_wrap=header == "name")
    for header in ("longest axis mm", "mass g", "hulls", "hull error mm", "poses"):
        table.add_column(header, justify="right")
    names = sorted((*builtin_names(), *imported_names()))
    for name in names:
        table.add_row(name, *_row(name))
    console = Console()
    if not console.is_terminal:
        console = Console(width=160)  # in a pipe nothing is to be cut off
    console.print(table)
    print(f"{len(names)} parts")
    return 0


def _row(name: str) -> tuple[str, ...]:
    if name in builtin_names() and not is_built(name):
        return ("(not built yet)",)
    try:
        part = store.load_part(store.parts_folder() / name)
    except BadPart:
        return ("(damaged: import it again)",)
    return (
        part.family,
        part.source,
        f"{1e3 * part.longest_axis:.1f}",
        f"{1e3 * part.mass:.3g}",
        str(part.n_hulls),
        f"{1e3 * part.hull_error:.2f}",
        str(len(part.resting_probability)),
    )


def _show(verb: Show) -> int:
    # Matplotlib takes a second to load; the other verbs do without it.
    from mskgrasp.parts.picture import draw_part

    part = find_part(verb.name)
    out = verb.out or Path(f"{part.name}.png")
    if out.suffix.lower() not in PICTURE_SUFFIXES:
        raise UsageError(f"--out {out}: the picture's name must end in {', '.join(PICTURE_SUFFIXES)}")
    if not out.parent.is_dir():
        raise UsageError(f"--out {out}: there is no folder {out.parent}: create it or choose another")
    draw_part(part, out)
    print(out)
    return 0
