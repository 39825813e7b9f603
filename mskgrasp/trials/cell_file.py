"""Cell file of a run, with the command line's overrides."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import yaml

from hal.errors import LoadTooHeavy
from hal.open_cell import cell_from_values, cell_from_yaml
from hal.sensor_noise import NoiseModel
from mskgrasp.core.config import check_config, read_yaml
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.core.settings import Tape
from mskgrasp.parts import Part

FINE = 3
"""Colour pixels per depth pixel along one axis where tape is measured, about as a Kinect v2 has."""


@dataclass(frozen=True, kw_only=True)
class CellFile:
    """A cell file with the command line's overrides.

    Attributes:
        path: The user's file.
        values: Its contents with the overrides.
        tape: Sizes of the tape squares that measure; None where a tracker measures.
        simulated: Whether the cell is simulated, so that several can run in parallel.
        clearance: Least distance of the middle of the pads from its table, metres.
    """

    path: Path
    values: dict[str, Any]
    tape: Tape | None
    simulated: bool
    clearance: float

    @property
    def noise(self) -> str:
        """Noise of a simulated camera; empty for another cell."""
        noise = self.values.get("noise", "off") or "off"
        return "" if not self.simulated else noise if isinstance(noise, str) else noise.get("model", "off")

    @property
    def digest(self) -> str:
        """SHA-256 of the values."""
        return hashlib.sha256(self._text().encode()).hexdigest()

    def write(self, folder: Path) -> Path:
        """Write a simulated cell's values into the folder; the path of the file to open.

        The file of another cell is opened in place, since it names files relative to its own folder.
        """
        if not self.simulated:
            return self.path
        write_whole(folder / "cell.yaml", self._text().encode())
        return folder / "cell.yaml"

    def _text(self) -> str:
        return yaml.safe_dump(self.values, sort_keys=False)


def read_cell(
    path: Path,
    *,
    noise: NoiseModel | None,
    measure: Literal["truth", "markers"],
    tape: tuple[float, float] | None,
) -> CellFile:
    """Read a cell file and apply overrides.

    Args:
        path: The file.
        noise: Noise of a simulated camera; None: as in the file.
        measure: ``markers`` adds tape, and colour finer than depth, to a simulated cell.
        tape: Sides of the larger and the smaller square, metres; None: the file's, or 12 and 8 mm.

    Raises:
        BadConfig: The file or a value is not valid.
        UsageError: An override does not apply to this cell.
    """
    values = read_yaml(path)
    if tape is not None and measure != "markers":
        raise UsageError("--tape needs --measure markers; add it")
    cell = cell_from_values(values, path)
    if noise is not None:
        if not cell.simulated:
            raise UsageError(
                f"--noise is for a simulated cell; {path} is of type {values.get('type')!r}: omit --noise"
            )
        kept = values.get("noise")
        values["noise"] = (kept if isinstance(kept, dict) else {}) | {"model": noise}
    squares = None
    if measure == "markers":
        squares = dict(zip(("large", "small"), tape, strict=True)) if tape else {}
        if cell.simulated and not cell.draws_tape:
            raise UsageError(
                f"--measure markers: {path} is of type {values['type']!r}, which draws no "
                "tape on parts; measure by its tracker (--measure truth), or use a cell of type sapien"
            )
        if cell.simulated:
            squares = squares or values.get("tape") or {}
            values |= {"tape": squares, "colour_scale": max(FINE, int(values.get("colour_scale", 1)))}
        squares = check_config(Tape, squares, "--tape" if tape else f"{path}: tape")
    cell_from_values(values, path)  # refuses an invalid file before any worker starts
    return CellFile(
        path=path,
        values=values,
        tape=squares,
        simulated=cell.simulated,
        clearance=cell.workspace.pads_clearance,
    )


def check_loads(cell_file: Path, parts: Iterable[Part]) -> None:
    """Refuse parts that the arm of a cell cannot carry, without connecting it.

    Raises:
        BadConfig: The file is missing or not valid.
        LoadTooHeavy: Names the part, its mass and what the arm carries.
    """
    arm = cell_from_yaml(cell_file).arm
    for part in parts:
        try:
            arm.check_load(part.mass)
        except LoadTooHeavy as error:
            raise LoadTooHeavy(f"{part.name}: {error}") from error
