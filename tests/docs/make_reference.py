"""The reference page, made from docstrings. Run ``python -m tests.docs.make_reference``; imports nothing."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "reference.md"
PACKAGES = ("mskgrasp", "hal", "tasks")

INTRODUCTION = """\
# Reference

Made from docstrings by `make reference`; do not edit. For every package: its purpose, the names it exports
(`__all__`), and its modules. Arguments, shapes, units and errors are in the docstrings: `help(NAME)`; on the
site that `make docs` builds, each package has a page with them.
"""


def reference() -> str:
    """The page as today's docstrings give it."""
    return INTRODUCTION + "".join(_section(package) for package in packages())


def packages() -> list[Path]:
    """Folders of all packages."""
    return [init.parent for package in PACKAGES for init in sorted((ROOT / package).rglob("__init__.py"))]


def _section(package: Path) -> str:
    tree = parse(package / "__init__.py")
    lines = ["", f"## {dotted(package)}", "", _escaped(ast.get_docstring(tree) or "")]
    names = exported_names(tree)
    if names:
        lines += ["", "| name | |", "|---|---|"]
        lines += [f"| `{name}` | {_escaped(_summary_of(name, package / '__init__.py'))} |" for name in names]
    modules = sorted(path for path in package.glob("*.py") if not path.stem.startswith("_"))
    if modules:
        lines += ["", "| module | |", "|---|---|"]
        lines += [
            f"| `{path.stem}` | {_escaped(_first(ast.get_docstring(parse(path))))} |" for path in modules
        ]
    return "\n".join(lines) + "\n"


def exported_names(tree: ast.Module) -> list[str]:
    """The names of ``__all__``, sorted."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(
            isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets
        ):
            return sorted(ast.literal_eval(node.value))
    return []


def _summary_of(name: str, file: Path) -> str:
    """First sentence of a name's docstring, wherever the file has it from."""
    found = find_definition(name, file)
    return "" if found is None else _first(found.docstring)


@dataclass(frozen=True)
class Definition:
    """Where a name is defined.

    Attributes:
        node: The class, function or assignment.
        docstring: Its docstring; empty: none.
    """

    node: ast.ClassDef | ast.FunctionDef | ast.Assign | ast.AnnAssign
    docstring: str


def find_definition(name: str, file: Path) -> Definition | None:
    """The definition of a name of a module, through the modules that it imports the name from."""
    body = [
        node
        for top in parse(file).body
        for node in (top.body if isinstance(top, ast.If) else [top])  # what `if TYPE_CHECKING:` imports
    ]
    for number, node in enumerate(body):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return Definition(node, ast.get_docstring(node) or "")
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            for alias in node.names:
                source = _file_of(node.module)
                if (alias.asname or alias.name) == name and source:
                    return find_definition(alias.name, source)
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(isinstance(target, ast.Name) and target.id == name for target in targets):
                return Definition(node, string_after(body, number))
    return None


def string_after(body: Sequence[ast.stmt], number: int) -> str:
    """The docstring below an assignment; empty: none."""
    following = body[number + 1] if number + 1 < len(body) else None
    value = following.value if isinstance(following, ast.Expr) else None
    return inspect.cleandoc(str(value.value)) if isinstance(value, ast.Constant) else ""


def _file_of(module: str) -> Path | None:
    path = ROOT / module.replace(".", "/")
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


def parse(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def dotted(package: Path) -> str:
    """The name of a package."""
    return ".".join(package.relative_to(ROOT).parts)


def _first(docstring: str | None) -> str:
    """The first paragraph, on one line."""
    return " ".join((docstring or "").strip().split("\n\n")[0].split())


def _escaped(text: str) -> str:
    return re.sub(r"``([^`]+)``", r"`\1`", text).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
