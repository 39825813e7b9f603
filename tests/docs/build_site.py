"""Documentation site (``make docs``): pages, site and a check of every link.

    python -m tests.docs.build_site

Makes build/pages from the repository, has Zensical build build/site from them, and ends with 1 if Zensical
warns, a link leads nowhere, or a page would load anything from another server.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from tests.docs.pages import ROOT
from tests.docs.site_pages import make_site_pages

PAGES, SITE = ROOT / "build" / "pages", ROOT / "build" / "site"
SEARCH = Path(__file__).with_name("file_worker.js")
_FOREIGN = "https://unpkg.com/iframe-worker/shim"
"""What Zensical has each page load for the search without a server; ours needs no network."""
_LOADED = {"script": "src", "img": "src", "link": "href", "source": "src", "iframe": "src"}
"""Attributes whose targets a browser loads with the page."""


class _Page(HTMLParser):
    """Links, loaded files and anchors of a page."""

    def __init__(self, path: Path):
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if tag in _LOADED and _LOADED[tag] in values and values.get("rel") != "canonical":
            self.loaded.append(values[_LOADED[tag]])


def faults(site: Path) -> list[str]:
    """A line for each link of a built site that leads nowhere, and each file loaded from another server."""
    pages = {path.resolve(): _Page(path) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        name = path.relative_to(site.resolve())
        if name.name == "404.html":  # its links are those of the site's root
            continue
        for target in page.loaded:
            if urlsplit(target).netloc:
                found.append(f"{name}: loads {target}")
        for target in [*page.links, *page.loaded]:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if file.is_dir():
                file = file / "index.html"
            if not file.is_file():
                found.append(f"{name}: no file {target}")
            elif parts.fragment and file in pages and unquote(parts.fragment) not in pages[file].anchors:
                found.append(f"{name}: no heading {target}")
    return found


def use_own_search(site: Path) -> None:
    """Have the pages load our script in place of the one of another server."""
    place = site / "assets" / "javascripts" / SEARCH.name
    shutil.copyfile(SEARCH, place)
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace(_FOREIGN, os.path.relpath(place, page.parent)), encoding="utf-8")


def main() -> int:
    """Make, build, check."""
    make_site_pages(PAGES)
    shutil.rmtree(SITE, ignore_errors=True)
    program = Path(sys.executable).with_name("zensical")
    if subprocess.run([program, "build", "--clean", "--strict"], cwd=ROOT).returncode:
        return 1
    use_own_search(SITE)
    found = faults(SITE)
    for line in dict.fromkeys(found):
        print(line, file=sys.stderr)
    if not found:
        print(f"wrote {SITE.relative_to(ROOT)}: open {SITE.relative_to(ROOT)}/index.html")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
