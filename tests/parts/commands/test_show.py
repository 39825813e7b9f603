"""The commands ``show`` and ``sheet``: where the picture goes, and what is refused before any is drawn."""

import re
from pathlib import Path

import matplotlib.image
import pytest

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import entry_of, make_index, read_index, write_index
from mskgrasp.parts.commands.show import Sheet, Show, resting_text, run_sheet, run_show
from mskgrasp.simulation.resting import Resting


def test_a_part_is_drawn_into_a_file_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    part = build_part("washer_m36")
    assert run_show(Show(name=str(part.folder))) == 0
    assert matplotlib.image.imread(tmp_path / "washer_m36.png").std() > 0.05


@pytest.mark.slow
def test_a_part_with_a_toppling_pose_is_shown_with_its_count_and_probability(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    part = build_part("wing_nut_m20")
    run_show(Show(name="wing_nut_m20", out=tmp_path / "a.svg"))
    shown = re.search(
        r"^resting poses: (\d+) of (\d+) stand in the engine; "
        r"left out, with ([\d.]+)% of the probability: (.*)$",
        capsys.readouterr().out,
        flags=re.M,
    )
    assert shown
    standing, n, left_out, named = shown.groups()
    poses = re.findall(r"pose (\d+) \(([\d.]+)%\)", named)
    assert int(n) == len(part.resting_probability) == int(standing) + len(poses)
    assert float(left_out) == pytest.approx(sum(float(share) for _, share in poses), abs=0.05)
    for number, share in poses:
        assert float(share) == pytest.approx(100 * part.resting_probability[int(number)], abs=0.01)


def test_a_part_that_stands_in_every_pose_is_shown_as_such(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    n = len(build_part("washer_m36").resting_probability)
    run_show(Show(name="washer_m36", out=tmp_path / "a.svg"))
    assert f"resting poses: all {n} stand in the engine" in capsys.readouterr().out.splitlines()


def test_a_part_that_stands_nowhere_is_shown_instead_of_failing():
    text = resting_text(Resting(stands=(False,), probability=(1.0,)))
    assert text.startswith("resting poses: none of 1 stands in the engine, so the part cannot be simulated")


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
