"""Planner for a cell, and presentation of a part in it."""

from __future__ import annotations

from pathlib import Path

from hal.cell import Cell
from hal.errors import HalError
from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import example_file
from mskgrasp.core.units import Unit
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.grasp_models import Models, load_models, require_hand
from mskgrasp.learning.label_source import other_conditions, source_text
from mskgrasp.parts.catalogue import require_name
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.progress import note


def make_planner(models: Path, config: PlannerConfig, cell: Cell) -> Planner:
    """Make the planner for a cell: loaded networks, and the cell's table.

    Raises:
        BadModel: The model cannot be used, or was made for another hand than the arm's.
    """
    loaded = load_models(models, compute_device())
    require_hand(loaded.meta, cell.arm.limits.gripper.geometry, models)
    return Planner.of_workspace(loaded, config, cell.workspace)


def tell_model(models: Models, cell: Cell) -> None:
    """Print the conditions of the labels that a model learned, and warn of those of a cell that differ."""
    if not models.meta.labels:
        print("model: the conditions of its labels are not stated")
    pose = cell.camera.T_base_camera
    height = None if pose is None else float(pose.position[2]) - cell.workspace.table_z
    for text in dict.fromkeys(map(source_text, models.meta.labels)):
        print(f"model: labels of {text}")
    warned = {"; ".join(other_conditions(source, cell.physics, height)) for source in models.meta.labels}
    for other in sorted(warned - {""}):
        note(f"warning: the model's labels were made under other conditions: here {other}")


def present(cell: Cell, part: str, seed: int) -> None:
    """Place a part on the table with the cell's feeder.

    Raises:
        HalError: The cell has no feeder.
    """
    if cell.feeder is None:
        raise HalError("this cell has no feeder; put the part there by hand and omit --part")
    cell.feeder.present(part, seed)


def check_unit(text: str, unit: Unit | None) -> None:
    """Refuse a unit for a user's name or folder of a part.

    Raises:
        UsageError: A unit is given for what is no file.
    """
    if unit is not None and not Path(text).is_file() and (Path(text).exists() or example_file(text) is None):
        raise UsageError(f"--unit is for a CAD file; {text} is none: omit it")


def part_name(text: str, unit: Unit | None = None) -> str:
    """Resolve a user's name, folder or CAD file to a part's name or folder.

    A CAD file is the part that was imported from it; one that was not is imported, as steel.

    The name of a shipped example refers to that file where the current folder has no such file.

    Raises:
        BadPart: The file cannot be imported as one part, or the name is empty.
        UsageError: A unit is given for what is no file.
    """
    require_name(text)
    check_unit(text, unit)
    path = Path(text)
    if not path.exists() and (example := example_file(text)) is not None:
        print(f"{text} is not in this folder: using the shipped example {example}")
        path = example
    if not path.is_file():
        return text
    from mskgrasp.parts.importing.import_file import part_of_file  # most parts need no decomposition

    return part_of_file(path, unit=unit).name
