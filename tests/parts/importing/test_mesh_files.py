"""Sizes, units and suffixes of mesh files."""

import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.mesh_files import read_content
from tests.parts.importing.reading import refusal

BOX = trimesh.creation.box((40, 30, 20))


@pytest.mark.parametrize(
    ("edge", "said"),
    [
        (
            0.06,
            "is 0.06 mm long when read in mm; the limits are 2 to 500 mm: --unit m would make it 60 mm",
        ),
        (1.5, "--unit in would make it 38.1 mm"),
        (1000.0, "no other --unit makes it fit"),
        (1e-9, "no other --unit makes it fit"),
        (1e30, "no other --unit makes it fit"),
    ],
)
def test_an_impossible_size_is_refused_with_the_unit_that_would_be_right(edge, said):
    assert said in refusal(
        "cube.ply", bytes(trimesh.creation.box((edge, edge, edge)).export(file_type="ply"))
    )


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("part.sldprt", "CAD files end in .stl"),
        ("part", "has the suffix '(none)'"),
        ("missing.stl", "No such file"),
        ("file.stl/inner.stl", "Not a directory"),
        ("folder.stl", "is a folder"),
        ("null.stl", "is a device"),
        ("empty.stl", "is empty"),
        ("blank.obj", "is empty"),
    ],
)
def test_what_is_no_file_of_a_known_kind_is_refused_before_reading(tmp_path, name, said):
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "null.stl").symlink_to("/dev/null")
    (tmp_path / "empty.stl").touch()
    (tmp_path / "file.stl").write_bytes(b"x")
    (tmp_path / "blank.obj").write_text("\n \n")
    with pytest.raises(BadPart, match=".*") as caught:
        read_content(tmp_path / name)
    assert said in str(caught.value) and "\n" not in str(caught.value)
