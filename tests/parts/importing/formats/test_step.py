"""STEP files, read from real bytes; damaged ones are refused in words."""

import sys
from pathlib import Path

import numpy as np
import pytest
from build123d import Box, Compound, Cylinder, Pos, export_step

from tests.parts.importing.reading import read, refusal, volume


def step(tmp_path: Path, shape) -> bytes:
    export_step(shape, tmp_path / "made.step")
    return (tmp_path / "made.step").read_bytes()


def test_a_step_solid_has_the_volume_of_the_formula(tmp_path):
    content = step(tmp_path, Box(40, 30, 20) - Cylinder(5, 30))
    for name in ("block.step", "block.STP"):
        file = read(name, content)
        assert file.unit == "mm" and len(file.objects) == 1
        assert volume(file) == pytest.approx(24_000 - np.pi * 25 * 20, rel=2e-4)
        assert np.allclose(file.objects[0].extents, [40, 30, 20], atol=1e-4)


def test_an_assembly_in_step_keeps_its_bodies_apart(tmp_path):
    file = read(
        "two.step", step(tmp_path, Compound(children=[Box(10, 10, 10), Pos(30, 0, 0) * Box(20, 20, 20)]))
    )
    assert sorted(item.volume for item in file.objects) == pytest.approx([1000, 8000], rel=1e-5)


def test_a_step_whose_triangles_are_too_far_from_their_origin_is_refused(tmp_path):
    def block(at: float):
        place = Pos(at, 0, 0)
        return step(tmp_path, place * Box(40, 30, 20) - place * Cylinder(5, 30))

    assert volume(read("near.step", block(1e4))) == pytest.approx(24_000 - np.pi * 25 * 20, rel=2e-4)
    assert "lies 24,976 times its length from its origin" in refusal("far.step", block(1e6))


def test_a_step_in_metres_comes_out_right_and_a_wrong_unit_is_refused(tmp_path):
    content = step(tmp_path, Box(40, 30, 20))
    assert "states its own unit, mm, and --unit says in" in refusal("box.step", content, "in")
    metres = content.replace(b"SI_UNIT(.MILLI.,.METRE.)", b"SI_UNIT($,.METRE.)")
    assert metres != content
    assert "is 40 m long when read in m" in refusal("box.step", metres)


def test_a_damaged_step_is_refused(tmp_path):
    content = step(tmp_path, Box(40, 30, 20))
    assert "is not a STEP file" in refusal("box.step", b"Dear colleague\n")
    assert "is cut off" in refusal("box.step", content[: len(content) // 2])
    hollow = b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    assert "is not a readable STEP" in refusal("box.step", hollow)


def test_without_cascadio_a_step_is_refused_with_the_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cascadio", None)  # how Python marks what cannot be imported
    assert "EXTRAS=dev,cad .ci/setup" in refusal("box.step", b"ISO-10303-21;")


# All of them
