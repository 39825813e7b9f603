"""Touches of the table with the closed fingers of any arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

import numpy as np

from hal.arm import Arm
from hal.cell import Cell, Workspace
from hal.errors import HalError
from hal.execute import APPROACH, go_home
from hal.limits import plane_height
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import pose_base_tcp

N_POINTS = 5
ABOVE = 0.02
"""Distance of the pads from the table, beyond the clearance, as the hand moves between points, metres."""
BELOW = 0.015
"""Depth under the first contact down to which the table is searched at the other points, metres."""
PART_ROOM = 0.08
"""No point is nearer than this to a part whose pose is known, metres."""
_TRAVEL_SPEED = 0.1


class TableNotFound(HalError):
    """The fingers met no table where it should be."""


def touch_points(region: tuple[float, float, float, float], part: np.ndarray | None) -> np.ndarray:
    """Five points (5, 2) of a region to touch: its corners and its middle, as far as no part is near.

    Args:
        region: x_min, x_max, y_min, y_max, base frame, metres.
        part: (2,) place of a part on the table; None if there is none, or nothing knows.
    """
    x_min, x_max, y_min, y_max = region
    x, y = (x_min + x_max) / 2, (y_min + y_max) / 2
    corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
    edges = [(x, y_min), (x_max, y), (x, y_max), (x_min, y)]
    points = np.array([*corners, (x, y), *edges])
    if part is not None:
        distance = np.linalg.norm(points - part, axis=1)
        near = distance < PART_ROOM
        # Those near the part come last, the nearest at the very end.
        points = points[np.lexsort([np.where(near, -distance, 0.0), near])]
    return points[:N_POINTS]


def touch_table(
    cell: Cell,
    *,
    search: float,
    force: float,
    speed: float,
    touched: Callable[[int, np.ndarray], None] = lambda number, point: None,
) -> np.ndarray:
    """Touch the table at five points with the closed fingers, then move the arm home.

    Args:
        cell: Its arm is connected; its region is clear but for a part that its tracker knows.
        search: Distance from its stated height within which the table is searched, metres.
        force: Force that is a touch, N.
        speed: Speed towards the table, m/s; twice as much for the first contact.
        touched: Called with the number and position (3,) of each point.

    Returns:
        (5, 3) touched points, base frame, metres.

    Raises:
        TableNotFound: The fingers met nothing there, or something above it; the hand has risen from there.
        HalError: The arm was stopped or lost, or cannot reach the points.
    """
    arm, workspace = cell.arm, cell.workspace
    part = None if cell.tracker is None else np.asarray(cell.tracker.part_pose().position)[:2]
    places = touch_points(workspace.region, part)
    go_home(cell)
    arm.move_gripper(0.0)
    arm.move_to_pose(_above(arm, places[0], workspace.table_z + APPROACH), speed=_TRAVEL_SPEED)
    first = _touch(arm, places[0], workspace.table_z - search, force, 2 * speed)
    if (fault := _fault_of_first(first, places[0], workspace, search)) is not None:
        _retreat(arm, workspace, fault)
    assert first is not None
    stated = plane_height(places, workspace.table_z, workspace.table_slope, workspace.centre)
    # The arm keeps the clearance from the table where it is stated, too.
    travel = max(first[2], stated.max()) + workspace.clearance + ABOVE
    points = []
    for number, place in enumerate(places):
        here = arm.state().T_base_tcp.position
        arm.move_to_pose(_above(arm, here[:2], travel), speed=_TRAVEL_SPEED)
        arm.move_to_pose(_above(arm, place, travel), speed=_TRAVEL_SPEED)
        point = _touch(arm, place, first[2] - BELOW, force, speed)
        if (fault := _fault_of_later(point, place, first[2], workspace.table_z + search)) is not None:
            _retreat(arm, workspace, fault)
        assert point is not None
        touched(number, point)
        points.append(point)
    # Going home opens the fingers first, which must not press on the table then.
    arm.move_to_pose(_above(arm, places[-1], travel), speed=_TRAVEL_SPEED)
    go_home(cell)
    return np.array(points)


def _above(arm: Arm, xy: np.ndarray, z: float) -> Pose:
    """Pose of a hand that points down with the tips of its pads at a height."""
    return pose_base_tcp(np.array([*xy, z + arm.limits.gripper.pad_reach, 0.0]))


def _touch(arm: Arm, xy: np.ndarray, lowest: float, force: float, speed: float) -> np.ndarray | None:
    """(3,) point where the pads touch the table; None if they reach a height without."""
    contact = arm.move_until_contact(_above(arm, xy, lowest), force=force, speed=speed)
    return None if contact is None else contact.apply(np.array([0.0, 0.0, arm.limits.gripper.pad_reach]))


def _retreat(arm: Arm, workspace: Workspace, fault: str) -> NoReturn:
    """Raise the hand straight up from where the search ended, and report.

    Raises:
        TableNotFound: Always, unless the hand could not rise.
        HalError: The hand could not rise.
    """
    error = TableNotFound(fault)
    here = arm.state().T_base_tcp.position
    try:
        arm.move_to_pose(_above(arm, here[:2], workspace.table_z + APPROACH), speed=_TRAVEL_SPEED)
    except HalError as stuck:
        raise stuck from error
    raise error


def _fault_of_first(
    point: np.ndarray | None, place: np.ndarray, workspace: Workspace, search: float
) -> str | None:
    """Why the first point is not on the table, and the remedy; None if it is."""
    where = f"({place[0]:.3f}, {place[1]:.3f}) m"
    stated = f"within {search * 1e3:g} mm of the height {workspace.table_z:.4f} m that is stated for it"
    remedy = "measure it by tape and give it as --table-at Z (base frame, m)"
    if point is None:
        return f"the fingers met no table at {where} {stated}; {remedy}"
    if point[2] > workspace.table_z + search:
        return (
            f"the fingers met something at {where}, {point[2]:.4f} m high, and no table {stated}; clear the "
            f"region, or {remedy}"
        )
    return None


def _fault_of_later(
    point: np.ndarray | None, place: np.ndarray, first_z: float, highest: float
) -> str | None:
    """Why a later point is not on the table, and the remedy; None if it is."""
    where = f"({place[0]:.3f}, {place[1]:.3f}) m"
    if point is None:
        return (
            f"the fingers met no table at {where} within {BELOW * 1e3:g} mm under the first contact, which "
            f"was {first_z:.4f} m high; keep workspace.region on the table, away from its edges, and clear "
            "what the first touch may have met"
        )
    if point[2] > highest:
        return (
            f"the fingers met something at {where}, {point[2]:.4f} m high, "
            f"{(point[2] - first_z) * 1e3:.1f} mm over the first contact; clear the region and touch it again"
        )
    return None
