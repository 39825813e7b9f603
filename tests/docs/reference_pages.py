"""Reference pages of the site: every exported name with its signature and docstring; imports nothing."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tests.docs.make_reference import (
    Definition,
    dotted,
    exported_names,
    find_definition,
    packages,
    parse,
    string_after,
)

SECTIONS = {
    "Args": "Arguments",
    "Attributes": "Attributes",
    "Returns": "Returns",
    "Raises": "Raises",
    "Yields": "Yields",
}
_LONGEST = 100
"""Characters of a signature on one line."""
_SECTION = re.compile(rf"^({'|'.join(SECTIONS)}):$")
_ITEM = re.compile(r"^(\*{0,2}[\w.]+(?:, \w+)*): (.*)$")


def reference_pages() -> dict[str, str]:
    """Pages by their file names: an index, and one of every package that exports names.

    A name that several packages export is documented where it is exported first; the others link to it.
    """
    homes: dict[tuple[str, str], str] = {}
    pages, rows = {}, []
    for package in packages():
        names = exported_names(parse(package / "__init__.py"))
        if not names:
            continue
        page = f"{dotted(package)}.md"
        summary = markdown(ast.get_docstring(parse(package / "__init__.py")) or "")
        blocks = [f"# {dotted(package)}", summary]
        for name in names:
            found = find_definition(name, package / "__init__.py")
            if found is None:  # a module of the package
                continue
            key = (name, ast.dump(found.node))
            if key in homes:
                blocks.append(f"## {name}\n\nSee [{homes[key]}]({homes[key]}.md#{name.lower()}).")
            else:
                homes[key] = dotted(package)
                blocks.append(definition(name, found))
        pages[page] = _with_ids("\n\n".join(blocks)) + "\n"
        first = summary.split("\n\n")[0].replace("\n", " ").replace("|", "\\|")
        rows.append(f"| [{dotted(package)}]({page}) | {first} |")
    head = "# Reference\n\nExported names of every package, with their docstrings. "
    table = "[All modules](../reference.md).\n\n| package | |\n|---|---|\n" + "\n".join(rows) + "\n"
    return pages | {"index.md": head + table}


def definition(name: str, found: Definition, level: int = 2) -> str:
    """A name with its signature, its docstring, and for a class its fields and public methods."""
    node = found.node
    blocks = [f"{'#' * level} {name}"]
    if isinstance(node, ast.ClassDef):
        bases = ", ".join(ast.unparse(base) for base in node.bases)
        blocks.append(_code(f"class {node.name}({bases})" if bases else f"class {node.name}"))
    elif isinstance(node, ast.FunctionDef):
        blocks.append(_code(_signature(node, name)))
    elif node.value is not None:
        value = ast.unparse(node.value)
        blocks.append(_code(f"{name} = {value}" if len(value) < 80 else f"{name} = ..."))
    blocks.append(markdown(found.docstring))
    if isinstance(node, ast.ClassDef):
        blocks += [*_fields(node), *_methods(node, name, level + 1)]
    return "\n\n".join(block for block in blocks if block)


def markdown(docstring: str) -> str:
    """A docstring in Google's style as Markdown: its sections become lists."""
    shown: list[str] = []
    inside = False
    for line in docstring.splitlines():
        section = _SECTION.match(line)
        if section:
            shown += ["", f"**{SECTIONS[section[1]]}**", ""]
            inside = True
        elif not inside:
            shown.append(line)
        elif line and not line.startswith(" "):
            shown += ["", line]
            inside = False
        elif line.startswith("    ") and not line.startswith("     "):
            item, first = _ITEM.match(line.strip()), shown[-1] == ""
            text = f"`{item[1]}`: {item[2]}" if item else line.strip()
            shown.append(f"- {text}" if item or first else f"    {text}")
        else:
            shown.append(f"    {line.strip()}" if line.strip() else "")
    return re.sub(r"``([^`]+)``", r"`\1`", "\n".join(shown)).strip()


def _fields(node: ast.ClassDef) -> list[str]:
    """The fields of a class whose docstring does not describe them as its attributes."""
    if "Attributes:" in (ast.get_docstring(node) or "").splitlines():
        return []
    rows = []
    for number, field in enumerate(node.body):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            name, default = field.target.id, "" if field.value is None else f" = {ast.unparse(field.value)}"
            meaning = markdown(string_after(node.body, number)).replace("\n", " ")
            if not name.startswith("_"):
                shown = f"- `{name}: {ast.unparse(field.annotation)}{default}`"
                rows.append(f"{shown}: {meaning}" if meaning else shown)
    return ["**Fields**\n\n" + "\n".join(rows)] if rows else []


def _methods(node: ast.ClassDef, name: str, level: int) -> list[str]:
    return [
        definition(f"{name}.{one.name}", Definition(one, ast.get_docstring(one) or ""), level)
        for one in node.body
        if isinstance(one, ast.FunctionDef) and not one.name.startswith("_") and ast.get_docstring(one)
    ]


def _signature(node: ast.FunctionDef, name: str) -> str:
    """The call with its types, on one line, or an argument a line."""
    marks = "".join(f"@{ast.unparse(one)}\n" for one in node.decorator_list)
    returns = "" if node.returns is None else f" -> {ast.unparse(node.returns)}"
    parts = list(_arguments(node.args))
    line = f"{name}({', '.join(parts)}){returns}"
    if len(line) > _LONGEST:
        line = f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + f"){returns}"
    return marks + line


def _arguments(found: ast.arguments) -> Iterator[str]:
    """Arguments with their defaults, without that of the object itself."""
    named = [*found.posonlyargs, *found.args]
    defaults = [None] * (len(named) - len(found.defaults)) + found.defaults
    for one, default in zip(named, defaults, strict=True):
        if one.arg not in ("self", "cls"):
            yield _argument(one, default)
    if found.vararg is not None:
        yield f"*{ast.unparse(found.vararg)}"
    elif found.kwonlyargs:
        yield "*"
    for one, default in zip(found.kwonlyargs, found.kw_defaults, strict=True):
        yield _argument(one, default)
    if found.kwarg is not None:
        yield f"**{ast.unparse(found.kwarg)}"


def _argument(one: ast.arg, default: ast.expr | None) -> str:
    equals = " = " if one.annotation is not None else "="
    return ast.unparse(one) + ("" if default is None else equals + ast.unparse(default))


def _code(text: str) -> str:
    return f"```python\n{text}\n```"


def _with_ids(text: str) -> str:
    """Anchors of headings: the names in lower case."""
    return re.sub(r"^(##+) (.*)$", lambda found: f"{found[0]} {{ #{found[2].lower()} }}", text, flags=re.M)
