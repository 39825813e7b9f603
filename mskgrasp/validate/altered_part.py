"""A part with another density, other hulls or another resting pose.

Outcomes with such parts show how much labels depend on the model of a part.
"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply, twist_and_swing
from mskgrasp.parts import Part, store
from mskgrasp.parts.builtin import recipe_of
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.parts.solids.decompose import MOST_HULLS, convex_pieces, fewest_hulls
from mskgrasp.parts.solids.shape import bores_filled_to
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.solids.stable_poses import stable_poses
from mskgrasp.parts.write_solid import write_solid
from mskgrasp.validate.config import FILLED_MM, JOINED_MM

MAX_LEAN = 0.1
"""Greatest swing between a start and the resting pose that replaces it, rad."""


def altered_part(part: Part, folder: Path, *, density: float = 1.0, hulls: str = "") -> Part:
    """A copy of a part under ``folder``.

    Args:
        part: The original.
        folder: Folder for the copy.
        density: Density of the copy divided by that of the original.
        hulls: One of `mskgrasp.validate.config.HULLS`; empty: those of the original. A part without a
            recipe has its own hulls as exact pieces.

    Raises:
        BadPart: The hulls are too far from the mesh, or more than PhysX should handle.
    """
    solid = _with_hulls(part, hulls) if hulls else _stored(part)
    if hulls and len(solid.hulls) > MOST_HULLS:
        raise BadPart(f"{part.name}: {len(solid.hulls)} hulls, at most {MOST_HULLS} are simulated")
    with store.kept_in(folder):
        try:
            return write_solid(
                solid,
                name=part.name,
                family=part.family,
                source=part.source,
                licence=part.licence,
                density=density * part.density,
                dimensions=part.dimensions,
                recipe_hash=f"altered: {density} {hulls} {part.content_hash}",
                coarse=part.grade == "coarse",
            )
        except BadPart as error:
            raise BadPart(f"{part.name}: {error}") from error


def resting_start(start: np.ndarray, rests: Pose) -> np.ndarray:
    """A start (7,) changed to the nearest resting pose; its turn about the vertical is kept.

    Where the nearest resting pose is more than `MAX_LEAN` away the start is returned unchanged.

    Args:
        start: ``T_base_obj`` on the table.
        rests: Resting poses (k), of which height and orientation count.
    """
    quat = start[3:]
    found = [twist_and_swing(quat_multiply(quat, quat_conjugate(rest))) for rest in rests.quat_wxyz]
    lean = np.array([float(swing) for _, swing in found])
    best = int(lean.argmin())
    if lean[best] > MAX_LEAN:
        return start
    half = float(found[best][0]) / 2
    turned = quat_multiply(np.array([np.cos(half), 0.0, 0.0, np.sin(half)]), rests.quat_wxyz[best])
    return np.array([start[0], start[1], rests.position[best, 2], *turned])


def mesh_rests(part: Part) -> Pose:
    """Resting poses of the part's mesh; the catalogue's are those of its hulls."""
    return stable_poses(1e3 * np.asarray(trimesh.load_mesh(part.mesh_path).vertices, dtype=np.float64))[0]


def _stored(part: Part) -> Solid:
    loaded = trimesh.load_mesh(part.mesh_path)
    mesh = trimesh.Trimesh(1e3 * np.asarray(loaded.vertices), loaded.faces, process=False)
    return Solid(mesh=mesh, hulls=tuple(1e3 * corners for corners in hull_corners(part)))


def _with_hulls(part: Part, hulls: str) -> Solid:
    with bores_filled_to(FILLED_MM[hulls]) if hulls in FILLED_MM else nullcontext():
        solid = _exact(part)
    if hulls in JOINED_MM:
        return Solid(mesh=solid.mesh, hulls=fewest_hulls(solid.mesh, solid.hulls, JOINED_MM[hulls]))
    if len(solid.hulls) > MOST_HULLS:
        return Solid(mesh=solid.mesh, hulls=fewest_hulls(solid.mesh, solid.hulls))
    return solid


def _exact(part: Part) -> Solid:
    try:
        recipe = recipe_of(part.name)
    except BadPart:
        return _stored(part)
    solid = recipe.make(recipe.dimensions)
    return solid if solid.hulls else Solid(mesh=solid.mesh, hulls=convex_pieces(solid.mesh))
