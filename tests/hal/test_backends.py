"""Backends of installed packages: how they are found, and what is said of those that cannot be used."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from hal import cell_from_yaml
from hal.errors import BadBackend
from mskgrasp.core.errors import BadConfig

GOOD = """
from hal import Backend, BackendConfig
from tests.hal.replay.toy import ToyArm, ToyCamera, toy_cell

class Settings(BackendConfig):
    size: int = 1

class Half(ToyCamera):
    def __init__(self, limits): pass

class Lacking(ToyArm):
    def _wait(self): ...

Lacking.__abstractmethods__ = frozenset({"_wait"})

class Unlimited(ToyArm):
    def __init__(self): pass

toy = Backend(config=Settings, make=lambda config, path: toy_cell())
a_camera = Backend(config=Settings, make=lambda config, workspace: ToyCamera())
lacking = Backend(config=Settings, make=lambda config, workspace: Lacking())
unlimited = Backend(config=Settings, make=lambda config, workspace: Unlimited())
nothing = Backend(config=Settings, make=lambda config, path: None)
function = lambda config, path: toy_cell()
loose = Backend(config=dict, make=function)
"""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Installs a package of a name with entry points and a module ``NAME_code``."""

    def package(name: str, group: str, points: dict[str, str], code: str = GOOD) -> None:
        site = tmp_path / name
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"{point} = {name}_code:{value}" for point, value in points.items()]
        (info / "entry_points.txt").write_text(f"[mskgrasp.{group}]\n" + "\n".join(lines) + "\n")
        (site / f"{name}_code.py").write_text(code)
        monkeypatch.syspath_prepend(str(site))

    return package


def cell_file(folder: Path, kind: str, **settings: object) -> Path:
    path = folder / "cell.yaml"
    path.write_text(yaml.safe_dump({"type": kind} | settings))
    return path


def arm_file(folder: Path, driver: str) -> Path:
    sections = {"camera": {"driver": "sapien"}, "workspace": {"table_z": 0.0}}
    return cell_file(folder, "devices", arm={"driver": driver}, **sections)


def test_a_cell_of_an_installed_package_is_built_from_its_section(install, tmp_path: Path):
    install("acme", "cells", {"toy": "toy"})
    cell = cell_from_yaml(cell_file(tmp_path, "toy", size=2))
    assert cell.workspace.grasp_force == 20.0 and not cell.simulated
    with pytest.raises(BadConfig, match="unknown key 'sise'; legal keys here: size"):
        cell_from_yaml(cell_file(tmp_path, "toy", sise=2))


def test_an_unknown_name_lists_the_known_ones_and_their_packages(install, tmp_path: Path):
    install("acme", "cells", {"toy": "toy"})
    with pytest.raises(
        BadConfig, match=r"'type' is 'toi'; legal: sapien.* \(built in\), toy \(package acme 1"
    ):
        cell_from_yaml(cell_file(tmp_path, "toi"))


def test_two_packages_of_one_name_are_refused(install, tmp_path: Path):
    install("acme", "cells", {"toy": "toy"})
    install("bolt", "cells", {"toy": "toy"})
    with pytest.raises(BadBackend, match=r"'toy' is offered by package \w+ 1.0 and by package \w+ 1.0; unin"):
        cell_from_yaml(cell_file(tmp_path, "toy"))


def test_a_package_that_takes_the_name_of_a_built_in_one_is_refused(install, tmp_path: Path):
    install("acme", "cells", {"sapien": "toy"})
    with pytest.raises(BadBackend, match="'sapien' is offered by this program and by package acme 1.0"):
        cell_from_yaml(cell_file(tmp_path, "sapien"))
    cell_from_yaml(cell_file(tmp_path, "mujoco"))  # another name is not affected


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "raise RuntimeError('no licence\\nask the vendor')",
            "cannot be imported: RuntimeError: no licence;",
        ),
        ("import a_vendor_that_is_not_here", "cannot be imported: ModuleNotFoundError"),
        ("raise SystemExit(3)", "cannot be imported: SystemExit: 3"),
        ("", "cannot be imported: AttributeError"),
    ],
)
def test_a_package_that_cannot_be_imported_is_one_line(install, tmp_path: Path, code: str, message: str):
    install("broken", "cells", {"toy": "toy"}, code)
    with pytest.raises(BadBackend) as caught:
        cell_from_yaml(cell_file(tmp_path, "toy"))
    assert f"toy of package broken 1.0 (broken_code:toy) {message}" in str(caught.value)
    assert "\n" not in str(caught.value) and caught.value.exit_code == 1


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("nothing", "must build a hal.Cell, and builds one of type NoneType"),
        ("function", "must be a hal.Backend of a hal.BackendConfig and a function, and is of type function"),
        ("loose", "must be a hal.Backend of a hal.BackendConfig"),
    ],
)
def test_a_cell_that_breaks_the_contract_is_one_line(install, tmp_path: Path, value: str, message: str):
    install("acme", "cells", {"toy": value})
    with pytest.raises(BadBackend) as caught:
        cell_from_yaml(cell_file(tmp_path, "toy"))
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("a_camera", "must build a hal.Arm, and builds one of type ToyCamera"),
        ("lacking", "cannot be built: TypeError: Can't instantiate abstract class Lacking"),
        ("unlimited", "has no limits; its constructor must call super().__init__(limits)"),
    ],
)
def test_an_arm_that_breaks_the_contract_is_one_line(install, tmp_path: Path, value: str, message: str):
    install("acme", "arms", {"odd": value})
    with pytest.raises(BadBackend) as caught:
        cell_from_yaml(arm_file(tmp_path, "odd"))
    assert message in str(caught.value) and "\n" not in str(caught.value)
