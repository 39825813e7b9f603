"""Parallel import: the same parts for any number of processes, and one bad file among good ones."""

import multiprocessing
import threading
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


def test_a_file_whose_process_ends_twice_is_refused_in_a_line_by_one_worker_too(tmp_path, capfd):
    trimesh.creation.box((40, 30, 20)).export(tmp_path / "box.stl")
    ended = threading.Event()

    def kill() -> None:
        while not ended.wait(0.01):
            for child in multiprocessing.active_children():
                child.kill()

    killing = threading.Thread(target=kill)
    killing.start()
    try:
        found = imported([tmp_path / "box.stl"], tmp_path / "parts", 1)
    finally:
        ended.set()
        killing.join()
    assert found["box.stl"].reason == (
        f"{tmp_path / 'box.stl'} ended the process that imported it, twice: memory was short, or a library "
        "crashed; free memory, or export it coarser"
    )
    assert capfd.readouterr().err.count("a process was lost (exit code -9)") == 1


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
