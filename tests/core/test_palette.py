"""Colours can be read on paper and on a screen, distinguished, and are stated in one place."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core import palette

ROOT = Path(__file__).parents[2]
COLOURS = {name: value for name, value in vars(palette).items() if name.isupper() and name != "DARK"}


def linear(colour: str) -> np.ndarray:
    """Linear RGB (3,) of an sRGB colour (IEC 61966-2-1)."""
    encoded = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def contrast(first: str, second: str) -> float:
    """Contrast ratio of WCAG 2.1: 1 for equal colours, 21 for black on white."""
    low, high = sorted(float(linear(one) @ [0.2126, 0.7152, 0.0722]) for one in (first, second))
    return (high + 0.05) / (low + 0.05)


def test_the_ratio_is_that_of_the_standard():
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # the standard's limit is #767676


@pytest.mark.parametrize(
    ("names", "least"),
    [
        (("INK", "SLATE"), 4.5),  # text: WCAG 2.1, 1.4.3
        (("FAINT", "BLUE", "ORANGE", "GREEN", "RED"), 3.0),  # graphics: WCAG 2.1, 1.4.11
    ],
)
def test_what_must_be_seen_on_white_has_the_contrast_of_the_standard(names: tuple[str, ...], least: float):
    assert all(contrast(COLOURS[name], "#ffffff") >= least for name in names)


def test_what_must_be_seen_in_the_dark_has_it_too():
    paper = palette.DARK["PAPER"]
    assert all(contrast(palette.DARK[name], paper) >= 4.5 for name in ("INK", "SLATE", "BLUE"))
    assert contrast(palette.DARK["FAINT"], paper) >= 3.0


def test_text_can_be_read_on_every_area():
    areas = [name for name in COLOURS if name.startswith("PALE")]
    assert len(areas) == 4
    assert all(contrast(palette.INK, COLOURS[name]) >= 7 for name in areas)


def test_no_two_colours_are_alike():
    for first, second in itertools.combinations(COLOURS.values(), 2):
        assert np.abs(linear(first) - linear(second)).max() > 0.02, (first, second)


def test_no_other_file_of_the_package_states_a_colour():
    files = [*(ROOT / "mskgrasp").rglob("*.py"), *(ROOT / "mskgrasp").rglob("*.j2")]
    stated = {
        path.name for path in files if re.search(r"#[0-9a-fA-F]{6}\b", path.read_text(encoding="utf-8"))
    }
    assert stated == {"palette.py"}
