"""Resting poses of a part that are the same but for a symmetry of the part, such as the sides of a nut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from scipy.optimize import minimize_scalar
from scipy.spatial import KDTree

from mskgrasp.core.geometry import Pose, wrap_angle
from mskgrasp.parts.part import Part

N_SURFACE = 30_000
N_COMPARED = 400
TOLERANCE = 4e-4
"""Distance within which `MOST` of the compared points lie on the other pose's surface, metres."""
MOST = 0.93
"""A keyway in the bore of a gear does not make all poses on its teeth different ones."""
_SAME_HEIGHT = 4e-4
_STEP = np.radians(1.5)


def alike_poses(part: Part) -> dict[int, tuple[int, float]]:
    """Find resting poses that another one, turned about the vertical, covers.

    Args:
        part: Any part.

    Returns:
        For each such pose, by its index, the lower index of the pose that it equals, and the turn (radians)
        about the vertical that carries that one into it.
    """
    surface = _surface(part)
    found: dict[int, tuple[int, float]] = {}
    originals: list[_Lying] = []
    for number in range(len(part.resting_probability)):
        lying = _Lying.of(part, surface, number)
        for other in originals:
            turn = lying.turn_from(other)
            if turn is not None:
                found[number] = other.number, turn
                break
        else:
            originals.append(lying)
    return found


@dataclass(frozen=True, eq=False)
class _Lying:
    """A part's surface in a resting pose, seen from the origin of obj."""

    number: int
    height: float
    inertia: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    tree: KDTree
    spacing: float

    @classmethod
    def of(cls, part: Part, surface: tuple[np.ndarray, np.ndarray, float], number: int) -> _Lying:
        points, normals, spacing = surface
        turned = Pose(position=np.zeros(3), quat_wxyz=part.resting.quat_wxyz[number])
        rotation = turned.as_matrix()[:3, :3]
        inertia = rotation @ part.inertia @ rotation.T
        return cls(
            number=number,
            height=float(part.resting.position[number, 2]),
            inertia=np.array([inertia[2, 2], inertia[0, 0] + inertia[1, 1]]) / part.mass,
            points=points @ rotation.T,
            normals=normals @ rotation.T,
            tree=KDTree(points @ rotation.T),
            spacing=spacing,
        )

    def turn_from(self, other: _Lying) -> float | None:
        """Turn that carries the other pose into this one; None where none does."""
        if abs(self.height - other.height) > _SAME_HEIGHT or not np.allclose(
            self.inertia, other.inertia, rtol=1e-2
        ):
            return None
        turns = np.arange(0.0, 2 * np.pi, _STEP)
        few = other.points[:: N_SURFACE // 60]
        moved = np.concatenate([_turned(few, turn) for turn in turns])
        apart = self.tree.query(moved)[0].reshape(len(turns), -1).mean(axis=1)
        compared = other.points[:: N_SURFACE // N_COMPARED]
        for which in np.argsort(apart)[:4]:
            if apart[which] > 2 * self.spacing:
                break
            turn = self._refined(compared, float(turns[which]))
            if np.quantile(self._off(compared, turn), MOST) < TOLERANCE:
                return float(wrap_angle(np.asarray(turn)))
        return None

    def _refined(self, compared: np.ndarray, start: float) -> float:
        found: Any = minimize_scalar(
            lambda turn: float(np.square(self._off(compared, turn)).mean()),
            bounds=(start - _STEP, start + _STEP),
            method="bounded",
            options=dict(xatol=1e-4),
        )
        return float(found.x)

    def _off(self, points: np.ndarray, turn: float) -> np.ndarray:
        """Distances (n,) of turned points from the planes at their nearest points of this surface."""
        moved = _turned(points, turn)
        distance, nearest = self.tree.query(moved)
        off = np.abs(((moved - self.points[nearest]) * self.normals[nearest]).sum(axis=1))
        # Far from every sample, a plane says nothing.
        return np.where(distance > 3 * self.spacing, distance, off)


def _turned(points: np.ndarray, turn: float) -> np.ndarray:
    cos, sin = np.cos(turn), np.sin(turn)
    x, y, z = points.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)


def _surface(part: Part) -> tuple[np.ndarray, np.ndarray, float]:
    """Points (n, 3) on the part's surface in random order, their normals, and their mean distance, metres."""
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, N_SURFACE, seed=0)[:2]
    return np.asarray(points), mesh.face_normals[faces], float(np.sqrt(mesh.area / N_SURFACE))
