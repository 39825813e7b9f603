from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from hal import cell_from_yaml
from hal.errors import HalError
from mskgrasp.learning.grasp_models import PRETRAINED
from mskgrasp.planning.for_cell import SIMULATED_CELL, make_planner, part_name, present
from mskgrasp.planning.planner import PlannerConfig


def test_a_planner_samples_over_the_cells_own_table():
    cell = cell_from_yaml(SIMULATED_CELL)
    workspace = replace(cell.workspace, table_z=0.1)
    planner = make_planner(PRETRAINED, PlannerConfig(), replace(cell, workspace=workspace))
    assert planner.table_z == 0.1 and planner.region == workspace.region


def test_a_part_cannot_be_presented_without_a_feeder():
    with pytest.raises(HalError, match="no feeder; .* leave --part away"):
        present(replace(cell_from_yaml(SIMULATED_CELL), feeder=None), "hex_nut_m30", 0)


def test_a_name_and_a_folder_stand_for_themselves(tmp_path: Path):
    assert part_name("hex_nut_m30") == "hex_nut_m30"
    assert part_name(str(tmp_path)) == str(tmp_path)
