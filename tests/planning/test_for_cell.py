from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from hal import cell_from_yaml
from hal.errors import HalError
from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.core.settings import Physics
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.learning.label_source import LabelSource
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner, part_name, present, tell_model


def test_a_planner_samples_over_the_cells_own_table():
    cell = cell_from_yaml(SIMULATED_CELL)
    workspace = replace(cell.workspace, table_z=0.1)
    planner = make_planner(PRETRAINED, PlannerConfig(), replace(cell, workspace=workspace))
    assert planner.table_z == 0.1 and planner.region == workspace.region


def test_a_model_tells_its_labels_and_warns_of_a_cell_unlike_theirs(capsys):
    models, cell = load_models(PRETRAINED), cell_from_yaml(SIMULATED_CELL)
    tell_model(replace(models, meta=models.meta.model_copy(update={"labels": ()})), cell)
    assert "are not stated" in capsys.readouterr().out
    source = LabelSource(
        simulation="4", fidelity="cpu", physics=Physics().model_dump(), noise={}, hand={}, camera_height=0.8,
        seed=0,
    )  # fmt: skip
    told = replace(models, meta=models.meta.model_copy(update={"labels": (source,)}))
    tell_model(told, cell)
    out, warned = capsys.readouterr()
    assert "model: labels of simulation version 4" in out and not warned
    tell_model(told, replace(cell, physics=Physics(friction_pad_part=0.9)))
    assert "here friction_pad_part 0.9, not 0.5" in capsys.readouterr().err
    twice = told.meta.model_copy(update={"labels": (source, source.model_copy(update={"planner": "0123"}))})
    tell_model(replace(told, meta=twice), replace(cell, physics=Physics(friction_pad_part=0.9)))
    out, warned = capsys.readouterr()
    assert out.count("model: labels of") == 2 and warned.count("warning") == 1
    high = told.meta.model_copy(update={"labels": (source.model_copy(update={"camera_height": 1.2}),)})
    tell_model(replace(told, meta=high), cell)
    assert "camera 0.80 m over the table, not 1.20" in capsys.readouterr().err


def test_a_part_cannot_be_presented_without_a_feeder():
    with pytest.raises(HalError, match="no feeder; .* omit --part"):
        present(replace(cell_from_yaml(SIMULATED_CELL), feeder=None), "hex_nut_m30", 0)


def test_a_name_and_a_folder_stand_for_themselves(tmp_path: Path):
    assert part_name("hex_nut_m30") == "hex_nut_m30"
    assert part_name(str(tmp_path)) == str(tmp_path)


def test_a_cad_file_is_made_a_part(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = tmp_path / "My Bracket.stl"
    trimesh.creation.box((4, 2, 1.5)).export(file)
    name = part_name(str(file))
    assert find_part(name).longest_axis == pytest.approx(0.004)
    assert part_name(str(file), "in") == name and find_part(name).longest_axis == pytest.approx(0.004 * 25.4)
    with pytest.raises(UsageError, match="--unit is for a CAD file; my-bracket is none: omit it"):
        part_name(name, "in")


def test_a_file_that_is_no_cad_file_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "part.stl").write_text("a letter")
    with pytest.raises(BadPart, match="part.stl"):
        part_name(str(tmp_path / "part.stl"))


def test_an_example_is_taken_by_its_name_unless_such_a_file_is_here(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    assert find_part(part_name("bracket.stl")).longest_axis > 0.02
    assert "using the shipped example" in capsys.readouterr().out
    trimesh.creation.box((4, 2, 1.5)).export(tmp_path / "bracket.stl")
    assert find_part(part_name("bracket.stl")).longest_axis == pytest.approx(0.004)
    assert capsys.readouterr().out == ""
