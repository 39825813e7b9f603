"""The program, as a user calls it."""

import matplotlib.image
import numpy as np
import pytest
import trimesh

from mskgrasp.parts import parts_folder, starter_names


@pytest.mark.slow
def test_build_list_and_show_work_one_after_the_other(program, tmp_path):
    built = program("build", "washer_m36", "parallel_key_b20x12x80")
    assert built.returncode == 0 and built.stdout.startswith("2 parts ready, 2 built now")
    listed = program("list")
    lines = listed.stdout.splitlines()
    assert listed.returncode == 0 and lines[-1] == f"{len(starter_names())} parts"
    washer = next(line for line in lines if line.startswith("washer_m36"))
    assert "ISO 7089" in washer and "66.0" in washer
    assert "not built yet" in next(line for line in lines if line.startswith("hex_nut_m30"))
    shown = program("show", "parallel_key_b20x12x80", "--out", "key.png")
    assert shown.returncode == 0
    image = matplotlib.image.imread(tmp_path / "key.png")
    assert image.shape[:2] == (1080, 1920)
    assert np.std(image[..., :3]) > 0.05


def test_import_goes_on_after_a_bad_file_and_says_so_with_its_exit_code(program, tmp_path):
    (tmp_path / "letter.stl").write_text("no mesh\n")
    trimesh.creation.box((400, 30, 20)).export(tmp_path / "long beam.stl")
    done = program("import", "letter.stl", "long beam.stl")
    assert done.returncode == 1
    assert "1 of 2 files imported" in done.stdout and (parts_folder() / "long-beam").is_dir()
    error, warning = sorted(done.stderr.splitlines())  # files are imported in parallel
    assert error.startswith("error: letter.stl") and warning.startswith("warning: long-beam is 400 mm long")


def test_mistakes_end_with_one_line_and_the_right_code(program):
    unknown = program("build", "washer_m63")
    assert unknown.returncode == 2 and "did you mean washer_m36" in unknown.stderr
    assert len(unknown.stderr.splitlines()) == 1
    several = program("import", "a.stl", "b.stl", "--name", "both")
    assert several.returncode == 2 and len(several.stderr.splitlines()) == 1
    assert program("bild").returncode == 2
