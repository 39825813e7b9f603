"""Slots of a pallet, from a YAML file or a single target of the command line, and their checks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from hal import Cell
from hal.errors import OutOfWorkspace
from mskgrasp.core.config import Config, read_config
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import Grasp
from mskgrasp.palletize.config import PalletizeConfig, parse_target
from mskgrasp.parts import Part
from mskgrasp.perception.footprint import Footprint, usual_footprint
from mskgrasp.planning.place_pose import Target, check_place

SEEN_TOLERANCE = 0.003
"""Error of a part's sides in a depth image, about a pixel, m."""
BESIDE = 0.05
"""Least distance of a slot's edge from the region in which parts are fed, m: placed parts must not reach into
it."""
_TOUCH = 1e-6
"""Slots that overlap by less touch, m."""
_ANGLES = np.radians([-90.0, -45.0, 0.0, 45.0])


@dataclass(frozen=True, kw_only=True)
class Slot:
    """Slot for one part.

    Attributes:
        x: Target of the part's centre, base frame, metres.
        y: The same.
        theta: Direction of the part's longer side seen from above, radians from base x; half a turn more is
            equivalent, since a depth image does not distinguish both.
        size: Extent along base x and y, metres; None: not checked.
    """

    x: float
    y: float
    theta: float
    size: tuple[float, float] | None = None

    def targets(self, footprint: Footprint) -> tuple[Target, Target]:
        """Both equivalent targets of a part with a footprint, the smaller turn first."""
        turn = float(wrap_half_turn(np.asarray(self.theta - footprint.theta)))
        other = turn - float(np.copysign(np.pi, turn))
        return Target(x=self.x, y=self.y, theta=turn), Target(x=self.x, y=self.y, theta=other)

    def fits(self, footprint: Footprint, tolerance: float = 0.0) -> bool:
        """Whether a part, turned to the slot's direction, fits into the slot."""
        if self.size is None:
            return True
        extent = footprint.extent(self.theta)
        return bool(np.all(extent <= np.array(self.size) + tolerance))


_Length = Annotated[float, Field(gt=0.0, le=1.0)]
_Coordinate = Annotated[float, Field(allow_inf_nan=False)]
_Count = Annotated[int, Field(ge=1, le=100)]


class SlotEntry(Config):
    """Slot in a file."""

    x: _Coordinate
    y: _Coordinate
    """Target of the part's centre, base frame, m."""
    theta_deg: float = Field(default=0.0, allow_inf_nan=False)
    """Direction of the part's longer side, degrees from base x."""
    size: tuple[_Length, _Length] | None = None
    """Extent along base x and y, m; null: not checked."""

    def slot(self) -> Slot:
        """The slot."""
        return Slot(x=self.x, y=self.y, theta=math.radians(self.theta_deg), size=self.size)


class Grid(Config):
    """Grid of slots."""

    first: tuple[_Coordinate, _Coordinate]
    """Smallest x and y of a slot's centre, m."""
    pitch: tuple[_Length, _Length]
    """Distance between slots along x and y, m."""
    n: tuple[_Count, _Count]
    """Number of slots along x and y."""
    theta_deg: float = Field(default=0.0, allow_inf_nan=False)
    """Direction of the parts' longer side, degrees from base x."""
    size: tuple[_Length, _Length] | None = None
    """Extent of each slot along x and y, m; null: the pitch."""

    @model_validator(mode="after")
    def _check(self) -> Grid:
        size = self.size or self.pitch
        for axis in (0, 1):
            if self.n[axis] > 1 and size[axis] > self.pitch[axis]:
                raise ValueError(f"slots of size {list(size)} overlap at a pitch of {list(self.pitch)} m")
        return self


class SlotsFile(Config):
    """File of slots: a grid, a list, or both."""

    grid: Grid | None = None
    slots: tuple[SlotEntry, ...] = ()

    def all_slots(self) -> list[Slot]:
        """The slots of the grid, along x first, then those of the list."""
        found = []
        if self.grid is not None:
            grid = self.grid
            found = [
                SlotEntry(
                    x=grid.first[0] + column * grid.pitch[0],
                    y=grid.first[1] + row * grid.pitch[1],
                    theta_deg=grid.theta_deg,
                    size=grid.size or grid.pitch,
                )
                for row in range(grid.n[1])
                for column in range(grid.n[0])
            ]
        return [entry.slot() for entry in [*found, *self.slots]]


def chosen_slots(config: PalletizeConfig) -> list[Slot]:
    """The slots of a run: those of its file, or its single target.

    Raises:
        BadConfig: The file cannot be read, or a value is not valid.
        UsageError: The file holds no slot, or two that overlap.
    """
    if config.slots is not None:
        return read_slots(config.slots)
    x, y, theta_deg = parse_target(config.target)
    return [Slot(x=x, y=y, theta=math.radians(theta_deg))]


def read_slots(path: Path) -> list[Slot]:
    """Read a file of slots, such as ``configs/palletize/grid.yaml``.

    Raises:
        BadConfig: The file cannot be read, or a value is not valid.
        UsageError: The file holds no slot, or two that overlap.
    """
    slots = read_config(SlotsFile, path).all_slots()
    if not slots:
        raise UsageError(f"{path} holds no slot; give a grid, or a list of slots such as {{x: 0.5, y: 0.05}}")
    if pair := _overlapping(slots):
        first, second = (f"{index + 1} at ({slots[index].x:g}, {slots[index].y:g}) m" for index in pair)
        raise UsageError(f"{path}: slot {first} and slot {second} overlap; move one, or make them smaller")
    return slots


def _overlapping(slots: Sequence[Slot]) -> tuple[int, int] | None:
    """Find two slots that overlap, by index; those without a size are points."""
    centres = np.array([[slot.x, slot.y] for slot in slots])
    sizes = np.array([slot.size or (0.0, 0.0) for slot in slots])
    for index in range(len(slots) - 1):
        apart = np.abs(centres[index + 1 :] - centres[index])
        least = np.maximum((sizes[index + 1 :] + sizes[index]) / 2 - _TOUCH, _TOUCH)
        overlaps = np.flatnonzero((apart < least).all(axis=1))
        if overlaps.size:
            return index, index + 1 + int(overlaps[0])
    return None


def check_slots_in_reach(cell: Cell, slots: Sequence[Slot]) -> None:
    """Refuse slots at which the arm cannot place a part grasped at every angle, before anything moves.

    Raises:
        UsageError: A slot is out of reach.
    """
    for number, slot in enumerate(slots, 1):
        for theta in _ANGLES:
            over = np.array([slot.x, slot.y, cell.workspace.table_z + 0.02])
            poses = [Grasp(position=over, theta=np.asarray(theta + turn)) for turn in (0.0, np.pi)]
            try:
                first_reachable(cell, poses)
            except OutOfWorkspace as error:
                name = "the target" if len(slots) == 1 else f"slot {number}"
                raise UsageError(
                    f"{name} at ({slot.x:g}, {slot.y:g}) m cannot be used: {error}; move it"
                ) from error


def check_slots_beside_region(cell: Cell, slots: Sequence[Slot]) -> None:
    """Refuse slots where a placed part would be taken for the next one, or lie where that one is presented.

    Raises:
        UsageError: The edge of a slot or, where it has no size, its centre is nearer than `BESIDE` to the
            region in which parts are fed.
    """
    for number, slot in enumerate(slots, 1):
        if _distance(cell, slot, slot.size or (0.0, 0.0)) < BESIDE - 1e-9:
            raise UsageError(f"slot {number} at ({slot.x:g}, {slot.y:g}) m {_too_near(cell)}")


def check_parts_beside_region(cell: Cell, pairs: Iterable[tuple[Part, Slot]]) -> None:
    """Refuse slots without a size as `check_slots_beside_region`, by the parts that are placed there.

    Raises:
        UsageError: A part in its most probable stable pose would be nearer than `BESIDE` to the region.
    """
    extents: dict[tuple[str, float], np.ndarray] = {}
    for part, slot in pairs:
        if slot.size is not None:
            continue
        if (part.name, slot.theta) not in extents:
            extents[part.name, slot.theta] = usual_footprint(part).extent(slot.theta)
        if _distance(cell, slot, extents[part.name, slot.theta]) < BESIDE - 1e-9:
            raise UsageError(f"{part.name} in the slot at ({slot.x:g}, {slot.y:g}) m {_too_near(cell)}")


def _distance(cell: Cell, slot: Slot, extent: Sequence[float] | np.ndarray) -> float:
    """Compute the distance of a rectangle around a slot's centre from the region of the next part, metres."""
    x_min, x_max, y_min, y_max = cell.workspace.region
    along, across = extent[0] / 2, extent[1] / 2
    return math.hypot(
        max(x_min - slot.x - along, 0, slot.x - along - x_max),
        max(y_min - slot.y - across, 0, slot.y - across - y_max),
    )


def _too_near(cell: Cell) -> str:
    x_min, x_max, y_min, y_max = cell.workspace.region
    return (
        f"is nearer than {BESIDE:g} m to the region of the next part, x {x_min:g} to {x_max:g} m, "
        f"y {y_min:g} to {y_max:g} m: move the slot"
    )


def first_reachable(cell: Cell, poses: Sequence[Grasp], *, tallest: float = 0.0) -> int:
    """Find the index of the first hand pose at which the arm can place a part.

    Args:
        cell: The cell.
        poses: Poses of the hand.
        tallest: Height of the tallest other thing over the table, metres.

    Raises:
        OutOfWorkspace: The arm reaches none; the reason for the first.
    """
    refused = []
    for index, pose in enumerate(poses):
        try:
            check_place(cell, pose, tallest=tallest)
            return index
        except OutOfWorkspace as error:
            refused.append(error)
    raise refused[0]


def check_room(pairs: Iterable[tuple[Part, Slot]]) -> None:
    """Refuse parts that do not fit into their slots in their most probable stable pose.

    Raises:
        UsageError: Parts are too large; the message gives their sizes.
    """
    too_large: dict[str, str] = {}
    room = ""
    for part, slot in pairs:
        if slot.size is None or part.name in too_large:
            continue
        footprint = usual_footprint(part)
        if not slot.fits(footprint):
            long, short = 1e3 * footprint.sides
            too_large[part.name] = f"{part.name} ({long:.0f} x {short:.0f} mm)"
            room = f"{1e3 * slot.size[0]:g} x {1e3 * slot.size[1]:g} mm"
    if too_large:
        raise UsageError(
            f"a slot of {room} is smaller than {', '.join(too_large.values())}; enlarge the slots, "
            "turn them (theta_deg), or choose other --parts"
        )
