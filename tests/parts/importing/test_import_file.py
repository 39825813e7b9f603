"""CAD files as they come: good ones become parts, others are refused in one line."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from build123d import Box, Cylinder, export_step

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.core.shipped import example_file
from mskgrasp.parts import find_part
from mskgrasp.parts.importing import import_file as importing
from mskgrasp.parts.importing.import_file import import_file, import_part, legal_name, part_of_file


def bracket() -> trimesh.Trimesh:
    foot, wall = trimesh.creation.box((50, 30, 6)), trimesh.creation.box((6, 30, 40))
    foot.apply_translation((25, 0, 3))
    wall.apply_translation((3, 0, 20))
    return trimesh.boolean.union([foot, wall], engine="manifold")


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_box_comes_out_with_its_mass_and_size_from_every_format(tmp_path, suffix):
    file = tmp_path / f"Würfel mit Ecken.{suffix}"
    box = trimesh.creation.box((40, 30, 20))
    box.apply_translation((100, 200, 300))
    box.export(file)
    part = import_part(file, density=1000.0)
    assert part.name == "wuerfel-mit-ecken"
    assert part.mass == pytest.approx(0.024)
    assert np.allclose(part.extents, [0.04, 0.03, 0.02])
    assert part.n_hulls == 1 and part.hull_error < 1e-6
    assert part.source == f"imported from {file.name}"
    assert find_part("wuerfel-mit-ecken").content_hash == part.content_hash


@pytest.mark.parametrize(("unit", "edge"), [("mm", 40.0), ("m", 0.04), ("in", 40 / 25.4)])
def test_units_are_converted(tmp_path, unit, edge):
    trimesh.creation.box((edge, edge, edge)).export(tmp_path / "cube.stl")
    assert import_part(tmp_path / "cube.stl", unit=unit).longest_axis == pytest.approx(0.04, rel=1e-5)


def test_a_mesh_wound_inwards_is_turned_right_side_out(tmp_path):
    box = trimesh.creation.box((40, 30, 20))
    box.invert()
    box.export(tmp_path / "box.stl")
    assert import_part(tmp_path / "box.stl").mass == pytest.approx(7850 * 24e-6)


def test_an_angle_is_cut_into_hulls_that_fit_and_the_same_ones_every_time(tmp_path, monkeypatch):
    bracket().export(tmp_path / "bracket.stl")
    part = import_part(tmp_path / "bracket.stl")
    assert 2 <= part.n_hulls <= 8
    assert part.hull_error < 0.002
    first = [path.read_bytes() for path in sorted(part.folder.iterdir())]
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "second"))
    again = import_part(tmp_path / "bracket.stl")
    assert [path.read_bytes() for path in sorted(again.folder.iterdir())] == first


def test_a_thin_sheet_is_cut_until_physx_takes_its_hulls(tmp_path):
    trimesh.creation.box((100, 60, 1)).export(tmp_path / "sheet.stl")
    part = import_part(tmp_path / "sheet.stl")
    assert part.n_hulls > 1 and part.hull_error < 1e-5


def test_a_pyramid_a_tetrahedron_and_a_cone_become_parts(tmp_path):
    square = [[0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0]]
    corners = np.array([[0, 0, 0], [40, 0, 0], [0, 40, 0], [0, 0, 40]])
    trimesh.convex.convex_hull(np.array([*square, [20, 20, 30]])).export(tmp_path / "pyramid.stl")
    trimesh.convex.convex_hull(corners).export(tmp_path / "tetra.stl")
    trimesh.creation.cone(15, 30, sections=64).export(tmp_path / "cone.stl")
    around = 32 * np.sin(2 * np.pi / 64) * 15**2  # area of the cone's polygon
    for name, volume in dict(pyramid=40**2 * 30 / 3, tetra=40**3 / 6, cone=around * 30 / 3).items():
        part = import_part(tmp_path / f"{name}.stl", density=1000.0)
        assert part.mass == pytest.approx(1e-6 * volume, rel=1e-5)
        assert part.grade == "fine"


def test_the_same_file_is_not_imported_twice_and_a_changed_one_replaces_the_part(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box((40, 30, 20)).export(file)
    first = import_part(file)
    made = (first.folder / "part.json").stat().st_mtime_ns
    assert (import_part(file).folder / "part.json").stat().st_mtime_ns == made
    trimesh.creation.box((40, 30, 25)).export(file)
    assert import_part(file).mass > first.mass


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


def write_open(file: Path) -> None:
    box = trimesh.creation.box((40, 30, 20))
    trimesh.Trimesh(box.vertices, box.faces[:-1], process=False).export(file)


def write_flat(file: Path) -> None:
    corners = [[0, 0, 0], [10, 0, 0], [0, 10, 0]]
    trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 1]], process=False).export(file)


def write_two_bodies(file: Path) -> None:
    boxes = [trimesh.creation.box((40, 30, 20)) for _ in range(2)]
    boxes[1].apply_translation((100, 0, 0))
    trimesh.util.concatenate(boxes).export(file)


def write_half(file: Path) -> None:
    content = trimesh.creation.annulus(10, 20, 15).export(file_type=file.suffix[1:])
    file.write_bytes(content[: len(content) // 2])


def write_not_finite(file: Path) -> None:
    box = trimesh.creation.box((40, 30, 20))
    vertices = np.array(box.vertices)
    vertices[0, 0] = np.nan
    trimesh.Trimesh(vertices, box.faces, process=False, validate=False).export(file)


def write_text(file: Path) -> None:
    file.write_text("Dear colleague, please find the part attached.\n" * 20)


def write_foreign_index(file: Path) -> None:
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")


@pytest.mark.parametrize(
    ("file_name", "write", "said"),
    [
        ("open.stl", write_open, "is open: 3 edges"),
        ("flat.stl", write_flat, "volume is zero"),
        ("two.stl", write_two_bodies, "2 separate bodies"),
        ("half.stl", write_half, "is cut off"),
        ("half.ply", write_half, "not a readable PLY"),
        ("infinite.ply", write_not_finite, "not finite"),
        ("letter.stl", write_text, "export it again"),
        ("letter.ply", write_text, "not a readable PLY"),
        ("index.obj", write_foreign_index, "export it again"),
        ("empty.obj", lambda file: file.touch(), "is empty"),
        ("zeros.stl", lambda file: file.write_bytes(bytes(84)), "holds no triangles"),
        ("part.step", write_text, "is not a STEP file"),
        ("part.iges", write_text, "CAD files end in .stl, .obj, .ply, .glb, .3mf, .step, .stp"),
        ("missing.stl", lambda file: None, "No such file"),
    ],
)
def test_a_bad_file_is_refused_in_one_line_and_leaves_nothing(tmp_path, own_cache, file_name, write, said):
    file = tmp_path / file_name
    write(file)
    with pytest.raises(BadPart) as caught:
        import_part(file)
    assert said in str(caught.value) and file_name in str(caught.value) and "\n" not in str(caught.value)
    assert not own_cache.exists() or not any(own_cache.iterdir())


def test_a_builtin_name_cannot_be_taken(tmp_path):
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "hex_nut_m20.stl")
    with pytest.raises(BadPart, match="belongs to a built-in part"):
        import_part(tmp_path / "hex_nut_m20.stl")


@pytest.mark.parametrize("density", [0.0, -1.0, float("nan"), float("inf"), 7.85, 1e6])
def test_a_density_must_be_that_of_a_solid(tmp_path, density):
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "box.stl")
    with pytest.raises(BadPart, match="density") as caught:
        import_part(tmp_path / "box.stl", density=density)
    assert ("not g/cm^3" in str(caught.value)) == (density == 7.85)


@pytest.mark.slow
def test_a_step_part_has_the_mass_of_the_formula(tmp_path):
    export_step(Box(40, 30, 20) - Cylinder(8, 30), tmp_path / "block.step")
    imported = import_file(tmp_path / "block.step", density=2700)
    part = imported.parts[0]
    assert part.mass == pytest.approx(2700e-9 * (24_000 - np.pi * 64 * 20), rel=2e-4)
    assert np.allclose(part.extents, [0.04, 0.03, 0.02], atol=1e-7)
    assert imported.unit == "mm" and not imported.unchanged


def test_a_cavity_makes_a_part_lighter_and_not_smaller(tmp_path):
    outer, inner = trimesh.creation.box((40, 30, 20)), trimesh.creation.box((20, 10, 10))
    inner.invert()
    trimesh.util.concatenate([outer, inner]).export(tmp_path / "hollow.stl")
    part = import_part(tmp_path / "hollow.stl", density=1000)
    assert part.mass == pytest.approx(0.022)
    full, hollow = np.array([20, 30, 40]) / 1000, np.array([10, 10, 20]) / 1000
    about_x = 0.024 / 12 * (full[0] ** 2 + full[1] ** 2) - 0.002 / 12 * (hollow[0] ** 2 + hollow[1] ** 2)
    assert part.inertia[0, 0] == pytest.approx(about_x, rel=1e-6)
    assert np.allclose(part.extents, [0.04, 0.03, 0.02])


def test_split_names_bodies_by_decreasing_volume_and_leaves_them_alone_the_next_time(tmp_path):
    write_two_bodies(tmp_path / "pair.stl")
    imported = import_file(tmp_path / "pair.stl", bodies="split", density=1000)
    assert [part.name for part in imported.parts] == ["pair-1", "pair-2"]
    assert [part.mass for part in imported.parts] == pytest.approx([0.024, 0.024])
    assert imported.notes == ("split into 2 parts",)
    assert import_file(tmp_path / "pair.stl", bodies="split", density=1000).unchanged
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "single.stl")
    assert [part.name for part in import_file(tmp_path / "single.stl", bodies="split").parts] == ["single"]


def test_union_makes_one_part_of_bodies_that_overlap(tmp_path):
    boxes = [trimesh.creation.box((40, 30, 20)) for _ in range(2)]
    boxes[1].apply_translation((20, 0, 0))
    trimesh.util.concatenate(boxes).export(tmp_path / "long.stl")
    imported = import_file(tmp_path / "long.stl", bodies="union", density=1000)
    assert imported.parts[0].mass == pytest.approx(0.036) and imported.parts[0].n_hulls == 1


def test_dust_beside_a_body_is_refused_as_a_part_of_its_own(tmp_path, own_cache):
    body, dust = trimesh.creation.box((40, 30, 20)), trimesh.creation.box((0.5, 0.5, 0.5))
    dust.apply_translation((50, 0, 0))
    trimesh.util.concatenate([body, dust]).export(tmp_path / "dusty.stl")
    with pytest.raises(BadPart, match="dusty-2 is 0.5 mm long"):
        import_file(tmp_path / "dusty.stl", bodies="split")
    assert not own_cache.exists() or not any(own_cache.iterdir())


@pytest.mark.parametrize(
    ("edge", "said"),
    [
        (1000.0, "is 1 m long when read in mm; the limits are 2 to 500 mm"),
        (0.05, "--unit m would make it 50 mm"),
    ],
)
def test_a_part_of_a_metre_and_one_in_the_wrong_unit_are_refused(tmp_path, edge, said):
    trimesh.creation.box((edge, edge / 20, edge / 20)).export(tmp_path / "bar.stl")
    with pytest.raises(BadPart) as caught:
        import_part(tmp_path / "bar.stl")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Größe 3", "groesse-3"),
        ("../../etc/passwd", "etc-passwd"),
        ("M8_Nut-v2", "m8_nut-v2"),
        ("Écrou", "ecrou"),
        ("a" * 300, "a" * 80),
    ],
)
def test_names_are_made_legal_and_never_leave_the_folder(text, name):
    assert legal_name(text) == name


@pytest.mark.parametrize("text", ["", "...", "部品", "--"])
def test_a_name_of_which_nothing_is_left_is_refused(text):
    with pytest.raises(BadPart, match="--name"):
        legal_name(text)
