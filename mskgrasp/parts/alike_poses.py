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
"""Distance within which `MOST` of the compared points lie from the other pose's surface, metres."""
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
    surface = PartSurface.of(part)
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
class PartSurface:
    """Samples of a part's surface.

    Attributes:
        points: (n, 3) on it in random order, in the frame obj, metres.
        normals: (n, 3) of it there.
        tree: Of the points.
        spacing: Their mean distance, metres.
    """

    points: np.ndarray
    normals: np.ndarray
    tree: KDTree
    spacing: float

    @classmethod
    def of(cls, part: Part) -> PartSurface:
        """Sample the surface of a part."""
        mesh = trimesh.load_mesh(part.mesh_path, process=False)
        points, faces = trimesh.sample.sample_surface(mesh, N_SURFACE, seed=0)[:2]
        points = np.asarray(points)
        spacing = float(np.sqrt(mesh.area / N_SURFACE))
        return cls(points=points, normals=mesh.face_normals[faces], tree=KDTree(points), spacing=spacing)

    def off(self, points: np.ndarray) -> np.ndarray:
        """Distances (m,) of points (m, 3) from the planes at their nearest samples, metres."""
        distance, nearest = self.tree.query(points)
        off = np.abs(((points - self.points[nearest]) * self.normals[nearest]).sum(axis=1))
        # Far from every sample, a plane says nothing.
        return np.where(distance > 3 * self.spacing, distance, off)

    def apart(self, first: Pose, second: Pose) -> float:
        """Distance from the part's surface at one pose within which `MOST` of it at another lies, metres."""
        compared = (first.inverse() @ second).apply(self.points[:: N_SURFACE // N_COMPARED])
        return float(np.quantile(self.off(compared), MOST))


@dataclass(frozen=True, eq=False)
class _Lying:
    """A part in a resting pose, seen from the origin of obj."""

    number: int
    height: float
    inertia: np.ndarray
    rotation: np.ndarray
    surface: PartSurface

    @classmethod
    def of(cls, part: Part, surface: PartSurface, number: int) -> _Lying:
        turned = Pose(position=np.zeros(3), quat_wxyz=part.resting.quat_wxyz[number])
        rotation = turned.as_matrix()[:3, :3]
        inertia = rotation @ part.inertia @ rotation.T
        return cls(
            number=number,
            height=float(part.resting.position[number, 2]),
            inertia=np.array([inertia[2, 2], inertia[0, 0] + inertia[1, 1]]) / part.mass,
            rotation=rotation,
            surface=surface,
        )

    def turn_from(self, other: _Lying) -> float | None:
        """Turn that carries the other pose into this one; None where none does."""
        if abs(self.height - other.height) > _SAME_HEIGHT or not np.allclose(
            self.inertia, other.inertia, rtol=1e-2
        ):
            return None
        turns = np.arange(0.0, 2 * np.pi, _STEP)
        few = other._points(60)
        moved = np.concatenate([_turned(few, turn) for turn in turns])
        apart = self.surface.tree.query(moved @ self.rotation)[0].reshape(len(turns), -1).mean(axis=1)
        compared = other._points(N_COMPARED)
        for which in np.argsort(apart)[:4]:
            if apart[which] > 2 * self.surface.spacing:
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

    def _points(self, n: int) -> np.ndarray:
        return self.surface.points[:: N_SURFACE // n] @ self.rotation.T

    def _off(self, points: np.ndarray, turn: float) -> np.ndarray:
        """Distances (n,) of turned points from this surface."""
        return self.surface.off(_turned(points, turn) @ self.rotation)


def _turned(points: np.ndarray, turn: float) -> np.ndarray:
    cos, sin = np.cos(turn), np.sin(turn)
    x, y, z = points.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)
