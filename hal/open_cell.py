"""Cells from YAML files; the only module that knows all built-in types."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, assert_never, get_args

from hal.backends import build, find_backend
from hal.cell import Cell
from hal.errors import OutOfWorkspace
from mskgrasp.core.config import check_config, read_yaml
from mskgrasp.core.errors import BadConfig

CellType = Literal["sapien", "mujoco", "devices", "recorded", "replay"]


@contextmanager
def open_cell(path: str | Path) -> Iterator[Cell]:
    """Open the cell that a YAML file describes: connected, and released when the block ends.

    Args:
        path: A file such as ``configs/cells/sapien.yaml``; its ``type`` chooses the backend.

    Raises:
        BadConfig: The file is missing or not valid.
        HalError: The devices cannot be used.
    """
    with cell_from_yaml(Path(path)).connected() as cell:
        yield cell


def cell_from_yaml(path: Path) -> Cell:
    """Build the cell that a YAML file describes; nothing is connected yet.

    Raises:
        BadConfig: The file is missing or not valid.
        BadBackend: An installed package's backend cannot be used.
    """
    return cell_from_values(read_yaml(path), path)


def cell_from_values(values: dict[str, Any], path: Path) -> Cell:
    """Build the cell that plain values describe; ``path`` is the file they come from.

    Raises:
        BadConfig: The values are not valid.
    """
    cell = _build(values, path)
    if not cell.recorded:
        _check_home(cell, path)
    return cell


def _check_home(cell: Cell, path: Path) -> None:
    """Refuse a home that the arm would refuse later, and keep-outs that it cannot keep.

    Raises:
        BadConfig: Names the joint, the place or the link and what it is near to, and the remedy.
    """
    arm = cell.arm
    if arm.links is None and arm.limits.keep_out:
        raise BadConfig(f"{path}: the links of this arm are unknown, so that it cannot keep out; omit it")
    try:
        arm.check_joints(cell.workspace.home)
    except OutOfWorkspace as error:
        raise BadConfig(
            f"{path}: home is refused: {error}; state other joints there, or correct the workspace's box, "
            "keep_out or the camera's pose"
        ) from error


def _build(values: dict[str, Any], path: Path) -> Cell:
    entry = find_backend(values.get("type"), "cells", get_args(CellType), f"{path}: 'type'")
    if entry is not None:
        return build(entry, Cell, values, str(path), path)
    kind: CellType = values["type"]
    match kind:
        case "sapien":
            from hal.sim import SapienCellConfig, sapien_cell

            return sapien_cell(check_config(SapienCellConfig, values, str(path)))
        case "mujoco":
            from hal.mujoco import MujocoCellConfig, mujoco_cell

            return mujoco_cell(check_config(MujocoCellConfig, values, str(path)))
        case "devices":
            from hal.devices import devices_cell

            return devices_cell(values, path)
        case "recorded":
            from hal.replay import RecordedCellConfig, recorded_cell

            recorded = check_config(RecordedCellConfig, values, str(path))
            if read_yaml(recorded.cell).get("type") == kind:
                raise BadConfig(f"{path}: 'cell' is {recorded.cell}, which is recorded itself; name another")
            return recorded_cell(cell_from_yaml(recorded.cell), recorded.out)
        case "replay":
            from hal.replay import ReplayCellConfig, replay_cell

            return replay_cell(check_config(ReplayCellConfig, values, str(path)))
        case _:
            assert_never(kind)
