"""Texts of cell files whose table is replaced; all else stays to the letter."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from hal.cell_file import with_values
from hal.touch.cell_file import require_table_writable, table_values, write_table
from mskgrasp.core.errors import BadConfig

BLOCK = """# a cell
type: devices
workspace:
  table_z: null    # not measured
  region: [0.38, 0.62, -0.12, 0.12]   # table_z: 0.3 is no key
"""


def with_table(text: str, z: float, slope: tuple[float, float] | None) -> str:
    return with_values(text, "workspace", table_values(text, z, slope), after="table_z")


def test_a_height_takes_the_place_of_null_and_comments_stay():
    assert with_table(BLOCK, 0.0123456, None) == BLOCK.replace("null", "0.01235")


def test_a_slope_gets_a_line_of_its_own():
    assert with_table(BLOCK, -0.002, (0.0087, -0.0001)) == BLOCK.replace(
        "null    # not measured\n", "-0.002    # not measured\n  table_slope: [0.0087, -0.0001]\n"
    )


@pytest.mark.parametrize(
    ("before", "slope", "after"),
    [
        ("workspace: {table_z: 0.1}\n", None, "workspace: {table_z: 0.25}\n"),
        ("workspace: {table_z: 0.1}", (0.01, 0.0), "workspace: {table_z: 0.25, table_slope: [0.01, 0.0]}"),
        ("workspace:\n  table_z: 1", (0.01, 0.0), "workspace:\n  table_z: 0.25\n  table_slope: [0.01, 0.0]"),
        ("workspace:\n  table_z:\n", None, "workspace:\n  table_z: 0.25\n"),
        (
            "workspace:\n  table_slope: [0.02, 0.01]  # old\n  table_z: 1\n",
            None,
            "workspace:\n  table_slope: [0.0, 0.0]  # old\n  table_z: 0.25\n",
        ),
    ],
)
def test_every_way_to_write_it_is_edited(before: str, slope: tuple[float, float] | None, after: str):
    assert with_table(before, 0.25, slope) == after
    assert yaml.safe_load(after)["workspace"]["table_z"] == 0.25


def test_small_numbers_are_written_as_numbers():
    text = with_table("workspace: {table_z: 0}", -0.00001, (-0.00003, -0.000001))
    assert yaml.safe_load(text)["workspace"] == {"table_z": -0.00001, "table_slope": [-0.00003, 0.0]}


@pytest.mark.parametrize("text", ["", "workspace: 3", "workspace: {region: [1]}", "table_z: 0.1"])
def test_a_file_without_the_key_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with pytest.raises(BadConfig, match=rf"{path}: the file has no workspace\.table_z"):
        require_table_writable(path)
    with pytest.raises(BadConfig, match=r"no workspace\.table_z"):
        write_table(path, 0.1, None)


def test_a_file_is_replaced_as_a_whole_through_a_link(tmp_path: Path):
    (tmp_path / "real.yaml").write_text(BLOCK)
    link = tmp_path / "link.yaml"
    link.symlink_to("real.yaml")
    write_table(link, 0.5, None)
    assert link.is_symlink() and (tmp_path / "real.yaml").read_text() == BLOCK.replace("null", "0.5")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.yaml", "real.yaml"]
