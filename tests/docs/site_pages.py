"""Pages of the documentation site, made from the repository's own pages, notebooks and docstrings.

The pages below docs/ keep their paths, links and anchors as on GitHub. A link that leads out of docs/, to a
page at the top or to a source file, leads to a copy of it in the site.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from tests.docs.notebooks import as_markdown
from tests.docs.pages import ROOT, anchor
from tests.docs.reference_pages import reference_pages

DOCS = ROOT / "docs"
PLACES = {
    ROOT / "README.md": Path("index.md"),
    ROOT / "ARCHITECTURE.md": Path("project/architecture.md"),
    ROOT / "CONTRIBUTING.md": Path("project/contributing.md"),
    ROOT / "CHANGELOG.md": Path("project/changes.md"),
    ROOT / "mskgrasp/learning/pretrained/card.md": Path("results/shipped_model.md"),
    DOCS / "results/README.md": Path("results/index.md"),
}
"""Where pages go that do not keep their path below docs/; the README's place is that of docs/index.md."""
ASSETS = (".png", ".gif", ".csv", ".svg", ".ipynb")
"""Suffixes of files that are copied as they are."""
_CODE = re.compile(r"(^```.*?^```|^(?: {4}|\t).*?$|``[^\n]+?``|`[^`\n]*`)", re.M | re.S)
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^(#+ )(.*?)$", re.M)
_LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml", ".md": "markdown"}


def make_site_pages(out: Path) -> None:
    """Write all pages and the files that they show into a folder, which is emptied first.

    Raises:
        FileNotFoundError: A page links to a file that does not exist.
    """
    shutil.rmtree(out, ignore_errors=True)
    for path in sorted(DOCS.rglob("*")):
        if path.suffix in ASSETS:
            _copy(path, out / path.relative_to(DOCS))
    sources = [*DOCS.rglob("*.md"), *(page for page in PLACES if page != ROOT / "README.md")]
    linked: set[Path] = set()
    for page in dict.fromkeys(sources):
        _write(out / site_path(page), _page(page.read_text(encoding="utf-8"), page, linked))
    for notebook in DOCS.rglob("*.ipynb"):
        _write(out / site_path(notebook), _page(as_markdown(notebook), notebook, linked))
    for source in sorted(linked):
        _write(out / site_path(source), _source_page(source))
    for name, text in reference_pages().items():
        _write(out / "reference" / name, text)


def site_path(path: Path) -> Path:
    """Where a file of the repository is in the site."""
    if path in PLACES:
        return PLACES[path]
    if path.is_relative_to(DOCS) and path.suffix in (".md", *ASSETS):
        inside = path.relative_to(DOCS)
        return inside.with_suffix(".md") if path.suffix == ".ipynb" else inside
    return Path("source") / f"{path.relative_to(ROOT)}.md"


def _page(text: str, page: Path, linked: set[Path]) -> str:
    """A page with links for its place in the site, and the anchors that GitHub gives its headings."""
    here = site_path(page).parent

    def moved(found: re.Match[str]) -> str:
        path, mark, part = found[1].partition("#")
        if "://" in path or path.startswith("mailto:") or not path:
            return found[0]
        target = (page.parent / path).resolve()
        if not target.exists():
            raise FileNotFoundError(f"{page.relative_to(ROOT)} links to {path}, which does not exist")
        own = target == page.with_suffix(".ipynb")
        place = target.relative_to(DOCS) if own else site_path(target)
        if place.parts[0] == "source":
            linked.update([target] if target.is_file() else _files(target))
            if target.is_dir():
                linked.add(target)
        return f"]({os.path.relpath(place, here)}{mark}{part})"

    pieces = _CODE.split(text)
    for k in range(0, len(pieces), 2):  # the others are code
        pieces[k] = _LINK.sub(moved, pieces[k])
    return _with_anchors("".join(pieces))


def _with_anchors(text: str) -> str:
    fenced = re.compile(r"(^```.*?^```)", re.M | re.S)
    pieces = fenced.split(text)
    for k in range(0, len(pieces), 2):
        pieces[k] = _HEADING.sub(lambda found: f"{found[0]} {{ #{anchor(found[2])} }}", pieces[k])
    return "".join(pieces)


def _source_page(path: Path) -> str:
    """A source file as a page, or a folder as a list of its files."""
    name = path.relative_to(ROOT)
    if path.is_dir():
        links = (
            f"- [{file.relative_to(path)}]({path.name}/{file.relative_to(path)}.md)" for file in _files(path)
        )
        return f"# {name}\n\n" + "\n".join(links) + "\n"
    language = _LANGUAGES.get(path.suffix, "text")
    return f"# {name}\n\n```{language}\n{path.read_text(encoding='utf-8').rstrip()}\n```\n"


def _files(folder: Path) -> list[Path]:
    found = (path for path in folder.rglob("*") if path.suffix in _LANGUAGES)
    return sorted(path for path in found if not {"build", "__pycache__"} & set(path.parts[len(ROOT.parts) :]))


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _copy(source: Path, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, path)
