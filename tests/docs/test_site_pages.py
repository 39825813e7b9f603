"""Pages of the documentation site: complete, linked, and in the navigation."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.docs.pages import ROOT, links
from tests.docs.site_pages import make_site_pages


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "pages"
    make_site_pages(folder)
    return folder


def navigation(entries: list[dict[str, Any]]) -> list[str]:
    """Pages of the navigation in their order."""
    found = []
    for entry in entries:
        for value in entry.values():
            found += [value] if isinstance(value, str) else navigation(value)
    return found


def test_every_link_of_the_site_leads_to_a_file_and_a_heading(site: Path):
    faults = []
    for page in site.rglob("*.md"):
        for link in links(page.read_text(encoding="utf-8")):
            if "://" in link or link.startswith("mailto:"):
                continue
            path, _, part = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.is_file() or site not in target.parents:
                faults.append(f"{page.relative_to(site)}: {link}")
            elif part and f"{{ #{part} }}" not in target.read_text(encoding="utf-8"):
                faults.append(f"{page.relative_to(site)}: no heading {link}")
    assert not faults


def test_every_page_is_in_the_navigation_once_except_for_source_files(site: Path):
    settings = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]
    listed = navigation(settings["nav"])
    pages = {str(page.relative_to(site)) for page in site.rglob("*.md")}
    assert len(set(listed)) == len(listed)
    assert set(listed) == {page for page in pages if not page.startswith("source/")}
    assert settings["theme"]["font"] is False and "offline" in settings["plugins"]


def test_a_link_out_of_the_pages_leads_to_a_copy_of_the_file_or_folder(site: Path):
    page = (site / "backends.md").read_text(encoding="utf-8")
    assert "](source/examples/six_axis_cell.md)" in page
    folder = (site / "source" / "examples" / "six_axis_cell.md").read_text(encoding="utf-8")
    assert "](six_axis_cell/cell.yaml.md)" in folder
    copy = (site / "source" / "examples" / "six_axis_cell" / "cell.yaml.md").read_text(encoding="utf-8")
    assert (ROOT / "examples" / "six_axis_cell" / "cell.yaml").read_text(encoding="utf-8").strip() in copy


def test_code_on_a_page_is_not_changed(site: Path):
    def code(text: str) -> list[str]:
        return re.findall(r"^ {4}.*$", text, flags=re.M)

    for name in ("collect.md", "learning.md", "import.md"):
        assert code((site / name).read_text()) == code((ROOT / "docs" / name).read_text())


def test_a_reference_page_has_signatures_docstrings_fields_and_methods(site: Path):
    page = (site / "reference" / "mskgrasp.md").read_text(encoding="utf-8")
    assert "## load_part { #load_part }" in page and "```python\nload_part(" in page
    assert "### Planner.plan { #planner.plan }" in page
    assert re.search(r"\*\*Arguments\*\*\n\n- `\w+`: ", page) and "**Raises**" in page
    assert "- `n_candidates: int = " in page  # a field of PlannerConfig, with its default
    assert "See [mskgrasp](mskgrasp.md#arm)." in (site / "reference" / "hal.md").read_text(encoding="utf-8")
