"""Parallel import: the same parts for any number of processes, and one bad file among good ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from mskgrasp.parts import store
from mskgrasp.parts.commands.import_files import FileResult, ImportOptions, import_files
from mskgrasp.parts.solids import solid as s
from tests.parts.solids.test_decompose import angle_body, mesh_of

OPTIONS = ImportOptions(
    name=None, family="imported", unit=None, density=1050.0, licence="CC0-1.0", bodies="one"
)


def heat_sink() -> Manifold:
    body = s.extrude(s.rectangle(0, 40, 0, 40), 0, 3)
    for x in np.arange(0, 39, 3.2):
        body += s.extrude(s.rectangle(x, x + 1.2, 0, 40), 2.9, 15)
    return body


def files(folder: Path) -> list[Path]:
    folder.mkdir()
    mesh_of(angle_body()).export(folder / "angle.stl")
    mesh_of(heat_sink()).export(folder / "heat sink.stl")
    trimesh.creation.annulus(15, 25, 12, sections=48).export(folder / "ring.obj")
    trimesh.creation.box((30, 20, 10)).export(folder / "angle.ply")
    (folder / "letter.stl").write_text("Dear colleague,\n" * 30)
    return sorted(folder.iterdir())


def imported(paths: list[Path], cache: Path, workers: int) -> dict[str, FileResult]:
    with store.kept_in(cache):
        return {result.path.name: result for result in import_files(paths, OPTIONS, workers)}


@pytest.mark.slow
def test_one_process_and_two_give_the_same_bytes_and_refuse_the_same_files(tmp_path):
    paths = files(tmp_path / "cad")
    for workers in (1, 2):
        found = imported(paths, tmp_path / f"{workers}", workers)
        assert {path.name for path in paths} == set(found)
        assert {name for name, result in found.items() if result.imported is None} == {
            "angle.stl",
            "letter.stl",
        }
        # The first of two files of one name is imported, whichever would be finished first.
        assert "would replace the part 'angle' of" in found["angle.stl"].reason
        assert "is not an STL (text" in found["letter.stl"].reason
    contents = [
        {str(path.relative_to(tmp_path / n)): path.read_bytes() for path in (tmp_path / n).glob("*/*")}
        for n in ("1", "2")
    ]
    assert contents[0] == contents[1]
    assert {name.split("/")[0] for name in contents[0]} == {"angle", "heat-sink", "ring"}


def test_a_heat_sink_is_a_plate_with_fins_to_its_hulls(tmp_path):
    path = tmp_path / "sink.stl"
    mesh_of(heat_sink()).export(path)
    (part,) = imported([path], tmp_path / "parts", 1)["sink.stl"].imported.parts
    assert part.grade == "fine" and 1e3 * part.hull_error < 0.2
    assert abs(part.hull_volume_ratio - 1) < 0.01
    assert part.n_hulls <= 28  # a plate cut to PhysX' slenderness, and 13 fins


@pytest.mark.slow  # three processes
def test_a_mesh_that_crashes_a_library_is_refused_in_a_line_and_others_are_imported(tmp_path, capfd):
    # As wide as the box: its walls touch, which CoACD does not survive.
    cavity = trimesh.creation.box((40, 30, 10))
    cavity.invert()
    (trimesh.creation.box((40, 30, 20)) + cavity).export(tmp_path / "a.stl")
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "b.stl")
    found = imported([tmp_path / "a.stl", tmp_path / "b.stl"], tmp_path / "parts", 1)
    assert found["b.stl"].imported is not None
    reason = found["a.stl"].reason
    assert "a.stl ended the process that imported it, twice: memory was short, or CoACD crashed" in reason
    assert "\n" not in reason
    assert capfd.readouterr().err.count("a process was lost (exit code -11)") == 1


def test_an_error_that_is_not_foreseen_is_the_refusal_of_the_file(tmp_path):
    paths = [tmp_path / "a.stl", tmp_path / "b.stl"]
    for path in paths:
        trimesh.creation.box((40, 30, 20)).export(path)
    heavy = replace(OPTIONS, density="heavy")  # pyright: ignore[reportArgumentType]
    results = list(import_files(paths, heavy, 1))
    assert [result.path for result in results] == paths
    for result in results:
        assert result.imported is None and "\n" not in result.reason
        assert result.reason.startswith(f"{result.path} could not be imported (TypeError: '<=' not supported")
        assert result.reason.endswith("a defect of mskgrasp, report it with the file")
