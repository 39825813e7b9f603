"""The commands ``show`` and ``sheet``: where the picture goes, and what is refused before any is drawn."""

from pathlib import Path

import matplotlib.image
import pytest

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import entry_of, make_index, read_index, write_index
from mskgrasp.parts.commands.show import Sheet, Show, run_sheet, run_show


def test_a_part_is_drawn_into_a_file_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    part = build_part("washer_m36")
    assert run_show(Show(name=str(part.folder))) == 0
    assert matplotlib.image.imread(tmp_path / "washer_m36.png").std() > 0.05


def test_a_suffix_that_is_no_picture_is_refused_with_the_legal_ones(tmp_path: Path):
    for refused in (Show(name="washer_m36", out=tmp_path / "a.jpg"), Sheet(out=tmp_path / "a.jpg")):
        with pytest.raises(UsageError, match=r"the suffix must be one of \.png, \.svg, \.pdf"):
            run_show(refused) if isinstance(refused, Show) else run_sheet(refused)


def test_a_folder_that_cannot_be_made_is_an_error_of_one_line(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match="cannot make folder") as caught:
        run_show(Show(name="washer_m36", out=tmp_path / "file" / "a.png"))
    assert "\n" not in str(caught.value)


def test_a_sheet_needs_a_catalogue_and_a_part(tmp_path: Path):
    with pytest.raises(BadPart, match="build --catalogue"):
        run_sheet(Sheet(out=tmp_path / "sheet.png"))
    build_part("washer_m36")
    write_index(make_index([entry_of("washer_m36")], {}, read_index()))
    with pytest.raises(UsageError, match="give at least 1"):
        run_sheet(Sheet(out=tmp_path / "sheet.png", parts=0))
    assert run_sheet(Sheet(out=tmp_path / "new" / "sheet.svg", parts=1)) == 0
    assert "<svg" in (tmp_path / "new" / "sheet.svg").read_text()
