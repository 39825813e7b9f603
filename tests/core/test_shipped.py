"""Files that ship with the package are found under their names, and nothing else is."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from mskgrasp.core.config import read_yaml
from mskgrasp.core.shipped import config_file, example_file

ROOT = Path(__file__).parents[2]


def test_every_configuration_of_the_checkout_is_shipped_under_its_own_path():
    names = [path.relative_to(ROOT / "configs") for path in (ROOT / "configs").rglob("*.yaml")]
    assert len(names) > 10
    for name in names:
        found = config_file(str(name))
        # Not by the link in the package: messages show the path, and users open that file.
        assert found == ROOT / "configs" / name and read_yaml(found)


def test_every_example_is_a_closed_mesh():
    names = [path.name for path in (ROOT / "mskgrasp" / "examples").iterdir()]
    assert "bracket.stl" in names
    for name in names:
        path = example_file(name)
        assert path is not None and trimesh.load_mesh(path).is_watertight


@pytest.mark.parametrize(
    "name", ["", ".", "..", "nothing.stl", "../examples/bracket.stl", "./bracket.stl", "/etc/passwd"]
)
def test_what_is_no_examples_name_is_no_example(name: str):
    assert example_file(name) is None
