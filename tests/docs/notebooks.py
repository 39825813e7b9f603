"""The tutorials: notebooks without outputs, as Markdown for the site, and run without Jupyter.

    python -m tests.docs.notebooks docs/tutorials/backend.ipynb      run all cells of a notebook

Cells hold plain Python, no shell commands and no magics: whoever has Python can run them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tests.docs.pages import ROOT

TUTORIALS = ROOT / "docs" / "tutorials"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """A cell of a notebook.

    Attributes:
        kind: Text in Markdown, or Python code.
        source: Its content.
        stored: What it stores besides, such as outputs.
    """

    kind: Literal["markdown", "code"]
    source: str
    stored: tuple[Any, ...]


def notebooks() -> list[Path]:
    """All tutorials."""
    return sorted(TUTORIALS.glob("*.ipynb"))


def read_cells(path: Path) -> Iterator[Cell]:
    """Cells of a notebook in nbformat 4."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        stored = (*cell.get("outputs", ()), *([count] if (count := cell.get("execution_count")) else ()))
        yield Cell(kind=cell["cell_type"], source="".join(cell["source"]), stored=stored)


def as_markdown(path: Path) -> str:
    """The page of a notebook, which links to the notebook itself beside it."""
    blocks = [
        cell.source if cell.kind == "markdown" else f"```python\n{cell.source}\n```"
        for cell in read_cells(path)
    ]
    note = f"This page is a notebook: [{path.name}]({path.name}). Open it in Jupyter, or read on."
    return "\n\n".join([blocks[0], note, *blocks[1:]]) + "\n"


def page_text(path: Path) -> str:
    """A page or a notebook as Markdown."""
    return as_markdown(path) if path.suffix == ".ipynb" else path.read_text(encoding="utf-8")


def run(path: Path) -> None:
    """Run the code of a notebook in the current folder; an error of a cell ends it."""
    names: dict[str, Any] = {"__name__": "notebook"}
    for number, cell in enumerate(read_cells(path), 1):
        if cell.kind == "code":
            exec(compile(cell.source, f"{path.name}, cell {number}", "exec"), names)


if __name__ == "__main__":
    run(Path(sys.argv[1]).resolve())
