"""STL from real bytes; damaged files are refused with the reason."""

import struct

import pytest
import trimesh

from tests.parts.importing.reading import read, refusal, volume

BOX = trimesh.creation.box((40, 30, 20))


def stl(mesh: trimesh.Trimesh) -> bytes:
    return bytes(mesh.export(file_type="stl"))


def test_a_binary_stl_whose_header_says_solid_is_read_as_binary():
    content = b"solid by CAD".ljust(80) + stl(BOX)[80:]
    assert volume(read("box.stl", content)) == pytest.approx(24_000, rel=1e-6)


def test_a_text_stl_of_several_solids_in_capitals_is_read():
    text = "".join(
        f"SOLID {name}\n"
        + "".join(
            "FACET NORMAL 0 0 0\n OUTER LOOP\n"
            + "".join(f"  VERTEX {x:.9e} {y:.9e} {z:.9e}\n" for x, y, z in triangle + shift)
            + " ENDLOOP\nENDFACET\n"
            for triangle in BOX.triangles
        )
        + f"ENDSOLID {name}\r\n"
        for name, shift in (("a", 0.0), ("b", 100.0))
    )
    assert volume(read("two.stl", text.encode())) == pytest.approx(48_000)
    assert "is cut off: no endsolid" in refusal("two.stl", text.encode()[: len(text) // 2])


def test_bytes_after_the_last_triangle_are_ignored_and_reported():
    file = read("box.stl", stl(BOX) + b"made by a CAD program")
    assert volume(file) == pytest.approx(24_000, rel=1e-6)
    assert file.notes == ("ignored 21 bytes after the last triangle",)


def test_a_cut_off_stl_says_what_was_stated_and_what_came():
    content = stl(BOX)
    message = refusal("box.stl", content[: 84 + 50 * 5 + 17])
    assert "states 12 triangles" in message and "ends after 5" in message
    lying = content[:80] + struct.pack("<I", 10**9) + content[84:]
    assert "states 1,000,000,000 triangles" in refusal("box.stl", lying)


def test_a_text_named_stl_is_called_a_text():
    assert "is not an STL (text" in refusal(
        "letter.stl", b"Dear colleague, please find the part attached.\n" * 9
    )
    assert "is not an STL" in refusal("letter.stl", b"hello")


def test_an_stl_too_far_from_its_origin_for_its_numbers_is_refused():
    far = BOX.copy()
    far.apply_translation((1e7, 0, 0))
    assert "move it to the origin" in refusal("far.stl", stl(far))
    near = BOX.copy()
    near.apply_translation((1e3, 0, 0))
    assert volume(read("near.stl", stl(near))) == pytest.approx(24_000, rel=1e-4)
