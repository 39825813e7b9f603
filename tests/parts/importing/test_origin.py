"""The file of an imported part, as its folder names it."""

import json
import os

import pytest
import trimesh

from mskgrasp.parts import find_part
from mskgrasp.parts.importing.import_file import import_part
from mskgrasp.parts.importing.origin import origin_of
from mskgrasp.parts.store import read_record


def test_a_part_names_its_file_and_what_it_was_imported_with(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box((1, 0.5, 0.4)).export(file)
    origin = origin_of(read_record(import_part(file, unit="in", bodies="union").folder))
    assert origin is not None and (origin.path, origin.unit, origin.bodies) == (file, "in", "union")
    assert origin_of(read_record(find_part("hex_nut_m30").folder)) is None


def test_a_path_that_is_not_utf_8_is_read_as_it_was(tmp_path):
    folder = tmp_path / os.fsdecode(b"W\xfcrfel\x80\xff")
    folder.mkdir()
    trimesh.creation.box((40, 30, 20)).export(folder / "Würfel.stl")
    part = import_part(folder / "Würfel.stl")
    origin = origin_of(read_record(part.folder))
    assert origin is not None and origin.path == folder / "Würfel.stl"
    assert "/Würfel.stl" in (part.folder / "part.json").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("key", "value"), [("path", 3), ("sha256", None), ("unit", "furlong"), ("bodies", [])]
)
def test_a_damaged_origin_counts_as_none(tmp_path, key, value):
    file = tmp_path / "box.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    part = import_part(file)
    record = part.folder / "part.json"
    values = json.loads(record.read_text())
    values["imported_from"][key] = value
    record.write_text(json.dumps(values))
    assert find_part("box").mass == part.mass and origin_of(read_record(part.folder)) is None
