"""CAD files as they come: good ones become parts, others are refused in one line."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from build123d import Box, Cylinder, export_step

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import find_part
from mskgrasp.parts.importing.import_file import import_file, import_part


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


def test_parts_left_of_an_earlier_split_of_the_same_file_are_named_and_kept(tmp_path, own_cache):
    def write(file: Path, count: int) -> None:
        boxes = [trimesh.creation.box((40 - i, 30, 20)) for i in range(count)]
        for i, box in enumerate(boxes):
            box.apply_translation((50 * i, 0, 0))
        trimesh.util.concatenate(boxes).export(file)

    file, other = tmp_path / "assembly.stl", tmp_path / "assembly-7.stl"
    write(other, 1)
    import_file(other, bodies="split")  # has such a name, but is another file's
    write(file, 3)
    import_file(file, name="assembly-two", bodies="split")  # as is one of another name
    assert import_file(file, bodies="split").notes == ("split into 3 parts",)
    write(file, 2)
    found = import_file(file, bodies="split")
    kept = "kept assembly-3 of an earlier import of it: delete the folders if not wanted"
    assert found.notes == ("split into 2 parts", kept)
    write(file, 1)
    assert import_file(file, bodies="split").notes == (kept.replace("-3", "-1, assembly-2, assembly-3"),)
    write(file, 2)
    assert import_file(file, bodies="split").notes[1].startswith("kept assembly, assembly-3 of")
    assert {path.name for path in own_cache.glob("assembly*")} == {
        "assembly", "assembly-1", "assembly-2", "assembly-3", "assembly-7",
        "assembly-two-1", "assembly-two-2", "assembly-two-3",
    }  # fmt: skip


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
