"""The reference page, made from docstrings. Run ``python -m tests.docs.make_reference``; imports nothing."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "reference.md"
PACKAGES = ("mskgrasp", "hal", "tasks")

INTRODUCTION = """\
# Reference

Made from docstrings by `make reference`; do not edit. For every package: its purpose, the names it exports
(`__all__`), and its modules. Arguments, shapes, units and errors are in the docstrings: `help(NAME)`.
"""


def reference() -> str:
    """The page as today's docstrings give it."""
    packages = [init.parent for package in PACKAGES for init in sorted((ROOT / package).rglob("__init__.py"))]
    return INTRODUCTION + "".join(_section(package) for package in packages)


def _section(package: Path) -> str:
    tree = _parse(package / "__init__.py")
    lines = ["", f"## {_dotted(package)}", "", _escaped(ast.get_docstring(tree) or "")]
    names = _exported(tree)
    if names:
        lines += ["", "| name | |", "|---|---|"]
        lines += [f"| `{name}` | {_escaped(_summary_of(name, package / '__init__.py'))} |" for name in names]
    modules = sorted(path for path in package.glob("*.py") if not path.stem.startswith("_"))
    if modules:
        lines += ["", "| module | |", "|---|---|"]
        lines += [
            f"| `{path.stem}` | {_escaped(_first(ast.get_docstring(_parse(path))))} |" for path in modules
        ]
    return "\n".join(lines) + "\n"


def _exported(tree: ast.Module) -> list[str]:
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(
            isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets
        ):
            return sorted(ast.literal_eval(node.value))
    return []


def _summary_of(name: str, file: Path) -> str:
    """First sentence of a name's docstring, wherever the file has it from."""
    body = [
        node
        for top in _parse(file).body
        for node in (top.body if isinstance(top, ast.If) else [top])  # what `if TYPE_CHECKING:` imports
    ]
    for number, node in enumerate(body):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return _first(ast.get_docstring(node))
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            for alias in node.names:
                source = _file_of(node.module)
                if (alias.asname or alias.name) == name and source:
                    return _summary_of(alias.name, source)
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            following = body[number + 1] if number + 1 < len(body) else None
            if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
                return _first(str(following.value.value))
    return ""


def _file_of(module: str) -> Path | None:
    path = ROOT / module.replace(".", "/")
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


def _parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _dotted(package: Path) -> str:
    return ".".join(package.relative_to(ROOT).parts)


def _first(docstring: str | None) -> str:
    """The first paragraph, on one line."""
    return " ".join((docstring or "").strip().split("\n\n")[0].split())


def _escaped(text: str) -> str:
    return re.sub(r"``([^`]+)``", r"`\1`", text).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
