"""Tables and the CSV file of the command ``list``."""

import csv
import os
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from mskgrasp.core.errors import UsageError
from mskgrasp.parts import build_part, parts_folder
from mskgrasp.parts.catalogue import Index, Rating, entry_of, make_index, read_index, write_index
from mskgrasp.parts.commands.list_ import List, run_list, write_csv
from mskgrasp.parts.importing.import_file import import_part

NAMES = ("parallel_pin_12x60", "parallel_pin_20x100", "washer_m36")


@pytest.fixture
def index() -> Index:
    """A catalogue of two pins and a washer, of which one pin is rated."""
    for name in NAMES:
        build_part(name)
    index = make_index([entry_of(name) for name in NAMES], {}, read_index())
    pin = index.parts["parallel_pin_12x60"]
    rating = Rating(
        attempts=200, successes=50, interval=(0.2, 0.31), part_hash=pin.content_hash, dataset="data"
    )
    index = replace(index, parts={**index.parts, pin.name: replace(pin, rating=rating)})
    write_index(index)
    return index


def lines_of(capsys: pytest.CaptureFixture[str], **options: object) -> list[str]:
    assert run_list(List(**options)) == 0  # pyright: ignore[reportArgumentType]
    return capsys.readouterr().out.splitlines()


def test_a_family_is_listed_part_by_part(index: Index, capsys: pytest.CaptureFixture[str]):
    header, _, first, second, count = lines_of(capsys, family="parallel_pin")
    assert header.startswith("name") and header.endswith("random grasps") and count == "2 parts"
    assert "60 x 12 x 12" in first and "ISO 2338" in first and first.endswith("25% (20% - 31%)")
    assert second.startswith("parallel_pin_20x100") and second.endswith("not rated")


def test_families_are_summarised(index: Index, capsys: pytest.CaptureFixture[str]):
    lines = lines_of(capsys, catalogue=True)
    pins = next(line for line in lines if line.startswith("parallel_pin"))
    assert pins.split()[1:5] == ["2", "60", "-", "100"] and pins.endswith("25% (1 rated)")
    assert "60-80 mm 2" in "".join(lines) and lines[-1] == "3 parts"


def test_the_csv_file_has_the_numbers_of_the_index(index: Index, tmp_path: Path):
    write_csv(index, tmp_path / "parts.csv")
    with open(tmp_path / "parts.csv", encoding="utf-8", newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert list(rows) == sorted(NAMES)
    for name, row in rows.items():
        entry = index.parts[name]
        assert float(row["longest_axis_mm"]) == pytest.approx(1e3 * entry.longest_axis, abs=0.006)
        assert float(row["mass_g"]) == pytest.approx(1e3 * entry.mass, abs=0.06)
    assert rows["parallel_pin_12x60"]["successes"] == "50" and rows["washer_m36"]["successes"] == ""


def test_the_csv_file_is_written_whole_where_there_can_be_one(index: Index, tmp_path: Path, program):
    made = tmp_path / "made" / "parts.csv"
    linked = tmp_path / "linked.csv"
    for _ in range(2):
        done = program("list", "--csv", str(made))
        assert done.returncode == 0 and len(made.read_text(encoding="utf-8").splitlines()) == 4
        assert [path.name for path in made.parent.iterdir()] == ["parts.csv"]
        os.link(made, linked) if not linked.exists() else None
    before = linked.read_bytes()
    write_csv(replace(index, parts={}), made)
    assert linked.read_bytes() == before  # not written over
    for unusable in (tmp_path / "made", made / "parts.csv", Path("/dev/null"), Path("/proc/parts.csv")):
        done = program("list", "--csv", str(unusable))
        assert done.returncode == 2 and "choose another path" in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_an_unknown_family_is_refused_with_the_legal_ones(index: Index):
    with pytest.raises(UsageError, match="no family 'pin': give one of parallel_pin, washer"):
        run_list(List(family="pin"))


def test_a_damaged_import_is_listed_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "block.stl")
    import_part(tmp_path / "block.stl")
    assert any(line.startswith("block ") and "40.0" in line for line in lines_of(capsys))
    (parts_folder() / "block" / "mesh.ply").write_bytes(b"ply")
    assert any(line.startswith("block ") and "damaged" in line for line in lines_of(capsys))
