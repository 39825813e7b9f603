"""Two squares of white tape on the simulated part, visual only."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import sapien
import trimesh
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import ConvexHull, QhullError

from mskgrasp.core.errors import TapeDoesNotFit
from mskgrasp.core.geometry import quat_conjugate, quat_rotate, quat_to_matrix
from mskgrasp.core.raster import raise_cells
from mskgrasp.core.settings import Tape
from mskgrasp.parts import Part

CELL = 0.0005
"""Distance of the rays from above, m."""
MARGIN = 0.0005
"""Least distance of a square from the edge of the face, m: a border of tape and table is no tape edge."""
RELIEF = 0.0015
"""Tape bridges steps, and bends over curves, up to this, m."""
GAP = 0.004
"""Least distance between both squares, m: nearer, a camera sees one."""
SIGHT = np.radians(75.0)
"""Greatest elevation of obstacles as seen from a square, so that the camera sees it."""
THICKNESS = 0.00015
"""Thickness of cloth tape, m."""
_WHITE = [1.0, 1.0, 1.0, 1.0]
_GAPS = (0.0, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032)


@dataclass(frozen=True, kw_only=True)
class Square:
    """One square of tape.

    Attributes:
        centre_obj: (3,) on the part's surface, obj frame, metres.
        vertices_obj: (k * k, 3) grid that lies on the surface, obj frame, metres; the four corners are
            those of a square seen from above.
    """

    centre_obj: np.ndarray
    vertices_obj: np.ndarray


def place_tape(
    vertices: np.ndarray, faces: np.ndarray, quat_base_obj: np.ndarray, tape: Tape, *, name: str
) -> tuple[Square, Square]:
    """Positions of the two squares, as far from each other as possible.

    Their sides lie along those of the part's smallest rectangle seen from above.

    Args:
        vertices: (n, 3) of the mesh, obj frame, metres.
        faces: (m, 3) of the mesh.
        quat_base_obj: (4,) orientation of the part.
        tape: Sizes of the squares.
        name: Name of the part, for the message.

    Returns:
        The larger and the smaller square.

    Raises:
        TapeDoesNotFit: The part's top has no room for them.
    """
    turned = quat_rotate(quat_base_obj, vertices)
    angle = np.radians(cv2.minAreaRect(turned[:, :2].astype(np.float32))[2])
    # Columns: the axes of the rectangle, in which rays are cast, in the obj frame.
    to_obj = quat_to_matrix(quat_conjugate(quat_base_obj)) @ trimesh.transformations.rotation_matrix(
        angle, [0, 0, 1]
    )[:3, :3]  # fmt: skip
    seen = vertices @ to_obj
    origin = seen.min(axis=0) - np.array([2 * CELL, 2 * CELL, 0.0])
    heights = heights_from_above((seen - origin) / np.array([CELL, CELL, 1.0]), faces)
    rooms = [_room(heights, side) for side in tape.sides]
    pair = _farthest(rooms, (tape.large + tape.small) / 2 + GAP)
    if pair is None:
        raise TapeDoesNotFit(
            f"part '{name}': its top has no room for two squares of {1e3 * tape.large:g} and "
            f"{1e3 * tape.small:g} mm side, {1e3 * GAP:g} mm apart; take smaller squares (tape: large, "
            "small), or a larger part"
        )
    large, small = (
        _square(heights, cell, side, origin, to_obj) for cell, side in zip(pair, tape.sides, strict=True)
    )
    return large, small


def heights_from_above(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Heights at which vertical rays from above first meet a mesh.

    Args:
        vertices: (n, 3), x and y in cells, all positive, z in metres.
        faces: (m, 3).

    Returns:
        (columns, rows) heights over z = 0, indexed [x, y], metres; -inf where a ray meets nothing.
    """
    columns, rows = np.ceil(vertices[:, :2].max(axis=0)).astype(int) + 3
    heights = np.full((rows, columns), -np.inf)
    x, y, z = np.ascontiguousarray(vertices.T)
    raise_cells(heights, x, y, z, faces)
    return heights.T


def _room(heights: np.ndarray, side: float) -> np.ndarray:
    """Cells (k, 2) at which a square may be centred."""
    width = _cells(side + 2 * MARGIN)
    low = minimum_filter(heights, width, mode="constant", cval=-np.inf)
    high = maximum_filter(heights, width, mode="constant", cval=-np.inf)
    with np.errstate(invalid="ignore"):
        free = np.isfinite(low) & (high - low <= RELIEF)
    for nearer, farther in zip(_GAPS[:-1], _GAPS[1:], strict=True):
        around = maximum_filter(heights, _cells(side + 2 * (MARGIN + farther)), mode="constant", cval=-np.inf)
        free &= around <= low + RELIEF + (MARGIN + nearer) * np.tan(SIGHT)
    return np.argwhere(free)


def _cells(length: float) -> int:
    return 2 * int(np.ceil(length / 2 / CELL)) + 1


def _farthest(rooms: list[np.ndarray], least: float) -> np.ndarray | None:
    """The two cells (2, 2), one of each room, that are farthest apart, and far enough along one axis."""
    if any(len(room) == 0 for room in rooms):
        return None
    first, second = (_corners(room) for room in rooms)
    apart = first[:, None] - second[None]
    distances = np.where(np.abs(apart).max(axis=-1) * CELL >= least, np.linalg.norm(apart, axis=-1), -np.inf)
    i, j = np.unravel_index(int(np.argmax(distances)), distances.shape)
    return np.array([first[i], second[j]]) if np.isfinite(distances[i, j]) else None


def _corners(cells: np.ndarray) -> np.ndarray:
    try:
        return cells[ConvexHull(cells).vertices]
    except QhullError:  # too few, or all in a row
        return cells


def _square(
    heights: np.ndarray, cell: np.ndarray, side: float, origin: np.ndarray, to_obj: np.ndarray
) -> Square:
    steps = np.linspace(-side / 2, side / 2, 2 * int(np.ceil(side / 2 / CELL / 2)) + 1)
    x, y = np.meshgrid(steps / CELL + cell[0], steps / CELL + cell[1], indexing="ij")
    # The highest of the cells around, so that no edge of the part comes through.
    z = maximum_filter(heights, 3)[np.rint(x).astype(int), np.rint(y).astype(int)]
    grid = np.stack([x * CELL, y * CELL, z + THICKNESS], axis=-1).reshape(-1, 3) + origin
    centre = np.array([*(cell * CELL), heights[tuple(cell)] + THICKNESS]) + origin
    return Square(centre_obj=to_obj @ centre, vertices_obj=grid @ to_obj.T)


def stick_tape(
    entity: sapien.Entity, part: Part, quat_base_obj: np.ndarray, tape: Tape
) -> tuple[Square, Square]:
    """Attach the squares, visual only, to a part; they move with it from now on.

    Args:
        entity: Simulated body of the part.
        part: The part, for its mesh.
        quat_base_obj: (4,) orientation of the part.
        tape: Sizes of the squares.

    Returns:
        The larger and the smaller square.

    Raises:
        TapeDoesNotFit: The part's top has no room for them.
    """
    mesh = trimesh.load_mesh(part.mesh_path)
    squares = place_tape(
        np.asarray(mesh.vertices), np.asarray(mesh.faces), quat_base_obj, tape, name=part.name
    )
    up = quat_rotate(quat_conjugate(quat_base_obj), np.array([0.0, 0.0, 1.0]))
    body = sapien.render.RenderBodyComponent()
    for square in squares:
        n = len(square.vertices_obj)
        k = int(np.sqrt(n))
        corner = (np.arange(k - 1)[:, None] * k + np.arange(k - 1)).reshape(-1)
        triangles = [[corner, corner + k, corner + 1], [corner + 1, corner + k, corner + k + 1]]
        # From arrays: SAPIEN 3.0.3 crashes the process when it is given a PLY file together with a material.
        shape = sapien.render.RenderShapeTriangleMesh(
            vertices=square.vertices_obj.astype(np.float32),
            triangles=np.concatenate([np.stack(t, axis=-1) for t in triangles]).astype(np.uint32),
            normals=np.tile(up.astype(np.float32), (n, 1)),
            uvs=np.zeros((n, 2), dtype=np.float32),
            material=sapien.render.RenderMaterial(base_color=_WHITE, roughness=1.0, specular=0.0),
        )
        body.attach(shape)
    entity.add_component(body)
    return squares
