"""CAD files that a program is given: the parts that were imported from them."""

import json
import os

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.core.shipped import example_file
from mskgrasp.parts import find_part
from mskgrasp.parts.importing import import_file as importing
from mskgrasp.parts.importing.import_file import import_file, import_part, part_of_file
from tests.parts.importing.test_import_file import write_two_bodies


def test_a_file_that_a_program_is_given_is_the_part_that_was_imported_from_it(tmp_path, capsys):
    file = tmp_path / "box.stl"
    trimesh.creation.box((4, 3, 2)).export(file)
    assert part_of_file(file).density == 7850.0
    light = import_part(file, unit="mm", density=1050.0, licence="MIT", bodies="union")
    assert part_of_file(file).content_hash == part_of_file(file, unit="mm").content_hash == light.content_hash
    inches = part_of_file(file, unit="in")
    assert inches.longest_axis == pytest.approx(0.004 * 25.4)
    assert (inches.density, inches.licence) == (1050.0, "MIT")  # of the import
    assert part_of_file(file).longest_axis == pytest.approx(0.004 * 25.4)  # as it was imported last
    moved = file.rename(tmp_path / "box.STL")
    assert part_of_file(moved).content_hash == inches.content_hash
    assert capsys.readouterr().err == ""


def test_a_file_whose_name_is_not_utf_8_is_a_part_like_any_other(tmp_path, capsys):
    file = tmp_path / os.fsdecode(b"geh\xe4use.stl")
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "box.stl")
    (tmp_path / "box.stl").rename(file)
    part = import_part(file, density=1050.0)
    assert part.name == "gehuse" and import_file(file, density=1050.0).unchanged
    assert part_of_file(file).content_hash == part.content_hash
    file.write_bytes(trimesh.creation.box((50, 30, 20)).export(file_type="stl"))
    changed = part_of_file(file)
    assert (changed.density, changed.extents[0]) == (1050.0, pytest.approx(0.05))
    assert "use.stl has changed since its import; imported again" in capsys.readouterr().err
    (tmp_path / "gehuse.stl").write_bytes(trimesh.creation.box((60, 30, 20)).export(file_type="stl"))
    with pytest.raises(BadPart, match="is another file"):
        part_of_file(tmp_path / "gehuse.stl")


def test_a_file_that_has_changed_is_imported_again_with_the_options_of_its_import(tmp_path, capsys):
    file = tmp_path / "pair.stl"
    box, beside = trimesh.creation.box((1, 0.5, 0.4)), trimesh.creation.box((1, 0.5, 0.4))
    beside.apply_translation((0.9, 0, 0))
    (box + beside).export(file)
    import_part(file, unit="in", density=1050.0, licence="MIT", bodies="union")
    box.apply_translation((0.1, 0, 0))
    (box + beside).export(file)
    part = part_of_file(file)
    assert part.extents == pytest.approx(25.4e-3 * np.array([1.8, 0.5, 0.4]))
    assert (part.density, part.licence) == (1050.0, "MIT")
    said = "pair.stl has changed since its import; imported again with 1050 kg/m^3, --unit in"
    assert said in capsys.readouterr().err
    assert part_of_file(file).content_hash == part.content_hash
    assert capsys.readouterr().err == ""


def test_a_file_is_the_same_part_through_a_link(tmp_path, capsys):
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "box.stl")
    link = tmp_path / "link.stl"
    link.symlink_to("box.stl")
    part = import_part(link, density=1050.0)
    assert (part.name, part_of_file(link).content_hash) == ("link", part.content_hash)
    assert capsys.readouterr().err == ""


def test_a_file_that_was_to_be_split_and_now_holds_two_bodies_is_no_part(tmp_path):
    file = tmp_path / "pair.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    import_part(file, bodies="split", density=1000)
    write_two_bodies(file)
    for _ in range(2):
        with pytest.raises(BadPart, match="holds 2 bodies now, which are the parts pair-1, pair-2: name one"):
            part_of_file(file)


def test_another_version_imports_a_file_again_with_the_options_of_its_import(tmp_path, monkeypatch, capsys):
    file = tmp_path / "box.stl"
    trimesh.creation.box((1, 0.5, 0.4)).export(file)
    part = import_part(file, unit="in", density=1050.0)
    monkeypatch.setattr(importing, "IMPORT_VERSION", importing.IMPORT_VERSION + 1)
    assert part_of_file(file).content_hash == part.content_hash
    assert "box.stl was imported by another version of mskgrasp; imported again" in capsys.readouterr().err
    assert part_of_file(file).content_hash == part.content_hash
    assert capsys.readouterr().err == ""


def test_a_program_does_not_replace_the_part_of_another_file(tmp_path):
    mine, other = tmp_path / "clamp.stl", tmp_path / "other" / "clamp.stl"
    other.parent.mkdir()
    trimesh.creation.box((40, 30, 20)).export(mine)
    trimesh.creation.box((50, 30, 20)).export(other)
    part = import_part(mine, density=1050.0)
    with pytest.raises(BadPart, match=r"was made of \S*clamp.stl, and \S*other/clamp.stl is another file"):
        part_of_file(other)
    assert part_of_file(mine).content_hash == find_part("clamp").content_hash == part.content_hash
    same = tmp_path / "copy" / "clamp.stl"
    same.parent.mkdir()
    same.write_bytes(mine.read_bytes())
    assert part_of_file(same).content_hash == part.content_hash
    assert import_part(other).extents[0] == pytest.approx(0.05)  # asked for by its name


def test_the_commands_in_refusals_keep_the_options_of_the_import(tmp_path, monkeypatch):
    file = tmp_path / "Clamp Part.stl"
    trimesh.creation.box((1, 0.5, 0.4)).export(file)
    options = dict(unit="in", density=1050.0, licence="MIT", family="my clamps", bodies="union")
    part = import_part(file, **options)
    with_options = "Part.stl' --density 1050 --unit in --union --family 'my clamps' --licence MIT"
    with pytest.raises(UnknownPart, match=f"name the part clamp-part, or import the file, .*{with_options}$"):
        find_part(str(file))
    other = tmp_path / "other" / file.name
    other.parent.mkdir()
    trimesh.creation.box((2, 0.5, 0.4)).export(other)
    with pytest.raises(BadPart, match=f"is another file: import it, .*{with_options}, in place of that part"):
        part_of_file(other)
    record = part.folder / "part.json"
    values = json.loads(record.read_text())
    del values["imported_from"]
    record.write_text(json.dumps(values))
    with pytest.raises(
        BadPart, match="Part.stl' --density 1050 --family 'my clamps' --licence MIT, with its --unit"
    ):
        part_of_file(file)
    # Of a built-in part of the name no option is taken.
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((40, 30, 20)).export("hex_nut_m20.stl")
    find_part("hex_nut_m20")
    with pytest.raises(
        UnknownPart, match="import it, python -m mskgrasp.parts import hex_nut_m20.stl, and name"
    ):
        find_part("hex_nut_m20.stl")


def test_a_shipped_example_does_not_replace_a_part_of_its_name(tmp_path):
    file = tmp_path / "bracket.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    part = import_part(file)
    example = example_file("bracket.stl")
    assert example is not None
    assert part_of_file(example).name == "example_bracket"
    assert part_of_file(file).content_hash == find_part("bracket").content_hash == part.content_hash


def test_a_part_that_does_not_name_its_file_is_to_be_imported_again(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    part = import_part(file, unit="mm", density=2700.0)
    record = part.folder / "part.json"
    values = json.loads(record.read_text())
    del values["imported_from"]  # as stored before parts named it
    record.write_text(json.dumps(values))
    assert find_part("box").content_hash == part.content_hash
    with pytest.raises(BadPart, match=r"does not say of which file .*: import it again, python -m mskgrasp"):
        part_of_file(file)
    assert not import_file(file, unit="mm", density=2700.0).unchanged
    assert part_of_file(file).content_hash == part.content_hash


def test_a_unit_that_the_import_did_not_name_leaves_the_density_as_it_is(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    light = import_part(file, density=2700.0)
    assert part_of_file(file, unit="mm").mass == pytest.approx(light.mass)
    assert part_of_file(file).mass == pytest.approx(light.mass)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("mass", -1.0, "is damaged .*: delete the folder, then build or import the part again"),
        (
            "schema_version",
            99,
            "has schema version 99, this program reads .*: build or import the part again",
        ),
    ],
)
def test_a_program_does_not_replace_a_part_that_it_cannot_read(tmp_path, key, value, said):
    file = tmp_path / "box.stl"
    trimesh.creation.box((1, 0.5, 0.4)).export(file)
    part = import_part(file, unit="in", density=1050.0)
    record = part.folder / "part.json"
    record.write_text(json.dumps(json.loads(record.read_text()) | {key: value}))
    before = record.read_bytes()
    with pytest.raises(BadPart, match=said):
        part_of_file(file)
    assert record.read_bytes() == before
    assert import_part(file, unit="in", density=1050.0).content_hash == part.content_hash


def test_a_mesh_on_which_coacd_crashes_is_refused_in_one_line(tmp_path):
    cavity = trimesh.creation.box((40, 30, 10))  # as wide as the box: its walls touch
    cavity.invert()
    (trimesh.creation.box((40, 30, 20)) + cavity).export(tmp_path / "box.stl")
    with pytest.raises(
        BadPart, match=r"box.stl: CoACD, .* crashed \(exit code -11\): repair its mesh where walls"
    ):
        part_of_file(tmp_path / "box.stl")
