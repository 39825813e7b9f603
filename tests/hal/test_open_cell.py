from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hal import cell_from_yaml
from mskgrasp.core.errors import BadConfig


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("type: sapiens", "'type' is 'sapiens'; legal: sapien"),
        ("part: hex_nut_m30", "'type' is missing; legal: sapien"),
        ("", "'type' is missing"),
        ("type: sapien\ngrasp_fource: 20", "unknown key 'grasp_fource'; legal keys here: camera"),
        ("type: sapien\ngrasp_force: 500", "'grasp_force': input should be less than or equal to 70"),
        ("type: sapien\nphysics: {gravity: 1}", "unknown key 'physics.gravity'"),
        ("type: sapien\nregion: [0.62, 0.38, -0.12, 0.12]", "region must be x_min < x_max"),
        ("type: sapien\nregion: [0.7, 0.9, -0.1, 0.1]", "reaches beyond the arm"),
        ("type: sapien\nregion: [0.4, 0.6, -0.2, 0.2]", "the camera sees 0.35 m"),
        ("type: !!python/object/apply:os.system ['true']", "not valid YAML"),
    ],
)
def test_a_wrong_cell_file_is_one_line_that_names_it(tmp_path: Path, text: str, message: str):
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with pytest.raises(BadConfig) as caught:
        cell_from_yaml(path)
    assert message in str(caught.value) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_cell_file_is_named(tmp_path: Path):
    with pytest.raises(BadConfig, match="No such file"):
        cell_from_yaml(tmp_path / "none.yaml")


def test_the_planner_needs_no_simulator():
    """A real cell's computer has neither SAPIEN nor ManiSkill."""
    code = (
        "import sys; sys.modules['sapien'] = sys.modules['mani_skill'] = None\n"
        "import hal, mskgrasp.planning.planner, mskgrasp.plan, mskgrasp.evaluate, mskgrasp.train"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
