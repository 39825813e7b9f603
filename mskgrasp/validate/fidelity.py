"""Fidelity of parts in the engine: surface, mass and inertia, against their meshes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import trimesh
from sapien.physx import PhysxCollisionShapeConvexMesh

from mskgrasp.parts import Part
from mskgrasp.parts.solids.measure import MOST_P95_MM, MOST_VOLUME_RATIO, hull_fit
from mskgrasp.validate.body_scene import BodyScene

MOST_MASS_ERROR = 1e-4
MOST_INERTIA_ERROR = 1e-2


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Errors of a part in the engine.

    Attributes:
        part: Name of the part.
        hulls: Number of cooked shapes.
        surface_p95: Distance of hulls and mesh that 95 % of both surfaces keep, m.
        volume_ratio: Volume of the hulls by that of the mesh.
        mass_error: Relative error of the engine's mass against density times the mesh's volume.
        inertia_error: Greatest relative error of a principal inertia against the mesh's.
    """

    part: str
    hulls: int
    surface_p95: float
    volume_ratio: float
    mass_error: float
    inertia_error: float

    @property
    def passed(self) -> bool:
        """Whether all errors are within their bounds."""
        return bool(
            self.surface_p95 <= 1e-3 * MOST_P95_MM
            and 1 / MOST_VOLUME_RATIO <= self.volume_ratio <= MOST_VOLUME_RATIO
            and self.mass_error <= MOST_MASS_ERROR
            and self.inertia_error <= MOST_INERTIA_ERROR
        )

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self) | {"passed": self.passed}


def check_parts(scene: BodyScene, parts: Sequence[Part], report: Callable[[], None]) -> list[Fidelity]:
    """Load every part into the engine and compare it with its mesh."""
    found = []
    for part in parts:
        scene.place(part, (*scene.env.region_centre, 0.5))
        found.append(_compare(part, scene))
        report()
    return found


def _compare(part: Part, scene: BodyScene) -> Fidelity:
    mesh = trimesh.load_mesh(part.mesh_path)
    mesh.density = part.density
    body = scene.body
    expected = np.sort(np.linalg.eigvalsh(mesh.moment_inertia))
    shapes = [shape for shape in body.collision_shapes if isinstance(shape, PhysxCollisionShapeConvexMesh)]
    cooked = [1e3 * shape.vertices * shape.scale for shape in shapes]
    fit = hull_fit(trimesh.Trimesh(1e3 * mesh.vertices, mesh.faces, process=False), cooked)
    return Fidelity(
        part=part.name,
        hulls=len(shapes),
        surface_p95=1e-3 * fit.p95,
        volume_ratio=fit.volume_ratio,
        mass_error=float(abs(body.mass / mesh.mass - 1)),
        inertia_error=float(np.abs(np.sort(body.inertia) / expected - 1).max()),
    )
