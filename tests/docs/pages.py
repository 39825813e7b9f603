"""The Markdown pages of the repository."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def pages() -> list[Path]:
    """README and the other pages at the top, everything under docs/, and the shipped model's card."""
    card = ROOT / "mskgrasp" / "learning" / "pretrained" / "card.md"
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), card])


def links(text: str) -> list[str]:
    """Targets of links and images outside of code."""
    return re.findall(r"\]\(([^)\s]+)\)", without_code(text))


def without_code(text: str) -> str:
    """A page without fenced blocks, indented blocks and code spans."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    text = re.sub(r"^ {4}.*$", "", text, flags=re.M)
    return re.sub(r"`[^`]*`", "", text)


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), flags=re.M)
    return {anchor(heading) for heading in headings}


def anchor(heading: str) -> str:
    """Anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
