"""The generated pages are those of today's docstrings and configurations."""

from __future__ import annotations

import yaml

from tests.docs.make_cell_file import PAGE as CELL_FILE
from tests.docs.make_cell_file import cell_file
from tests.docs.make_reference import PAGE, reference
from tests.docs.pages import ROOT


def test_the_reference_is_current():
    assert PAGE.read_text(encoding="utf-8") == reference(), "run make reference"


def test_the_page_of_a_cells_file_is_current():
    assert CELL_FILE.read_text(encoding="utf-8") == cell_file(), "run make reference"


def test_the_page_of_a_cells_file_has_every_key_of_the_shipped_files():
    page = CELL_FILE.read_text(encoding="utf-8")
    for file in (ROOT / "configs" / "cells").glob("*.yaml"):
        values = yaml.safe_load(file.read_text(encoding="utf-8"))
        sections = [values, *(one for one in values.values() if isinstance(one, dict))]
        for key in {key for section in sections for key in section} - {"type", "driver", "arm", "workspace"}:
            assert f"| `{key}` |" in page, (file.name, key)
