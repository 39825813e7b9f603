"""Mass, inertia, size and hull fit of solids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh64, OpType
from scipy.spatial import ConvexHull, KDTree

from mskgrasp.core.geometry import quat_from_matrix
from mskgrasp.parts.part import FINE_P95_MM, FINE_VOLUME_RATIO

MOST_SAMPLES = 12_000
"""Number of points on each surface at which hulls and mesh are compared."""
_KEPT = 6
"""Number of sets of hulls whose comparison is kept: as many as a search joins pieces in steps."""

MOST_ASPECT_RATIO = 50.0
"""PhysX on a GPU drops hulls whose length is about 64 times their thickness."""

_FAR = 1000.0
"""A mesh this many times its length from its origin is integrated about its own middle.

Integrals about the origin grow with the distance, and the inertia is a small difference of them: six of its
digits are right here, and none a hundred times farther.
"""

MOST_P95_MM = FINE_P95_MM
"""95 % of the surfaces of hulls and mesh have to be within this distance."""

MOST_VOLUME_RATIO = FINE_VOLUME_RATIO
"""Largest ratio between the volumes of hulls and mesh, either way."""


@dataclass(frozen=True, kw_only=True)
class MassProperties:
    """Mass properties of a body of uniform density.

    Attributes:
        volume: Cubic metres.
        mass: kg.
        centroid: (3,) metres, in the frame of the given mesh.
        inertia: (3, 3) about the centroid, kg m^2.
        principal_inertia: (3,) kg m^2.
        quat_principal: (4,) wxyz, the principal axes in the mesh's axes.
    """

    volume: float
    mass: float
    centroid: np.ndarray
    inertia: np.ndarray
    principal_inertia: np.ndarray
    quat_principal: np.ndarray


@dataclass(frozen=True, kw_only=True)
class HullFit:
    """Deviation of the union of the hulls from the mesh; lengths in millimetres.

    Attributes:
        largest: Largest distance found between the two surfaces, either way.
        p95: 95th percentile of the distance over both surfaces.
        volume_ratio: Volume of the union by that of the mesh.
        outward_largest: Largest distance from the hulls' surface to the mesh.
        outward_p95: 95th percentile of the same.
        inward_largest: Largest distance from the mesh to the hulls' surface.
        inward_p95: 95th percentile of the same.
    """

    largest: float
    p95: float
    volume_ratio: float
    outward_largest: float
    outward_p95: float
    inward_largest: float
    inward_p95: float


def mass_properties(mesh_mm: trimesh.Trimesh, density: float) -> MassProperties:
    """Integrate over a watertight mesh in millimetres; density in kg/m^3."""
    middle = mesh_mm.bounds.mean(axis=0)
    # Nearer meshes stay where they are, so that stored parts are built again to the last bit.
    far = np.abs(middle).max() > _FAR * mesh_mm.extents.max()
    triangles = mesh_mm.triangles - middle if far else mesh_mm.triangles
    # In millimetres and scaled afterwards: in metres the integrals of small parts fall below tolerances.
    found = trimesh.triangles.mass_properties(triangles, density=1.0, skip_inertia=False)
    inertia = np.asarray(found.inertia, dtype=float) * density * 1e-15
    inertia = (inertia + inertia.T) / 2
    principal, axes = _principal_axes(inertia)
    volume = float(found.volume) * 1e-9
    centroid = np.asarray(found.center_mass, dtype=float)
    return MassProperties(
        volume=volume,
        mass=volume * density,
        centroid=(centroid + middle if far else centroid) / 1000,
        inertia=inertia,
        principal_inertia=principal,
        quat_principal=quat_from_matrix(axes),
    )


def _principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and right-handed axes as columns (3, 3)."""
    diagonal = np.diag(inertia)
    if np.abs(inertia - np.diag(diagonal)).max() < 1e-6 * diagonal.max():
        # The mesh's own axes are principal; rounding must not give a symmetric part arbitrary ones.
        return diagonal.copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    largest = np.abs(axes).argmax(axis=0)
    axes = axes * np.sign(axes[largest, range(3)])
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1
    return moments, axes


def longest_axis(mesh: trimesh.Trimesh) -> float:
    """Longest edge of the oriented box of least volume, in the mesh's unit."""
    _, extents = trimesh.bounds.oriented_bounds(mesh)
    # Round parts have several boxes of least volume; the one along the axes is preferred.
    if np.prod(mesh.extents) <= np.prod(extents) * 1.0001:
        extents = mesh.extents
    return float(np.max(extents))


def hull_fit(mesh_mm: trimesh.Trimesh, hulls_mm: Sequence[np.ndarray]) -> HullFit:
    """Compare the surface of the union of the hulls with that of the mesh."""
    return MeshSurface(mesh_mm).fit(hulls_mm)


class MeshSurface:
    """A mesh prepared for comparison with several sets of hulls.

    Attributes:
        volume: Of the mesh, mm^3.
        surface: Its triangles, finely cut.
        samples: (n, 3) points on it, mm.
        areas: (n,) that each represents, mm^2.
    """

    def __init__(self, mesh_mm: trimesh.Trimesh) -> None:
        """Refine the surface and build its search tree."""
        # Copies: manifold3d takes neither a read-only array nor a view with strides.
        body = Manifold(Mesh64(np.array(mesh_mm.vertices, np.float64), np.array(mesh_mm.faces, np.uint64)))
        self._step = float(np.max(mesh_mm.extents)) / 40
        self.volume = float(mesh_mm.volume)
        self.surface = _Surface(_triangles(body.refine_to_length(self._step)))
        self.samples, self.areas = _samples(self.surface.triangles)
        self._compared: dict[bytes, _Comparison] = {}

    def fit(self, hulls_mm: Sequence[np.ndarray]) -> HullFit:
        """Compare the surface of the union of the hulls with that of the mesh."""
        return self._compare(hulls_mm).fit

    def fit_within(
        self,
        hulls_mm: Sequence[np.ndarray],
        most_p95: float,
        most_ratio: float,
        most_outward: float = np.inf,
    ) -> HullFit | None:
        """The fit where it is within the bounds, otherwise None, as soon as that is certain.

        Args:
            hulls_mm: Corners (n, 3) of each hull.
            most_p95: 95th percentile of the distance, either way.
            most_ratio: Volume of the union by the mesh's, or the mesh's by the union's.
            most_outward: Largest distance from the hulls' surface to the mesh.
        """
        compared = self._compare(hulls_mm)
        union = compared.union
        if not 1 / most_ratio <= union.volume / self.volume <= most_ratio:
            return None
        # The 95th percentile is certain where more than 5 % of both surfaces is beyond it already.
        beyond = float(union.areas[compared.outward > most_p95].sum())
        both = float(union.areas.sum() + self.areas.sum())
        if compared.outward.max() > most_outward or beyond > 0.0501 * both:
            return None
        return compared.fit if compared.fit.p95 <= most_p95 else None

    def outward_largest(self, hulls_mm: Sequence[np.ndarray]) -> float:
        """Largest distance from the surface of the union of the hulls to the mesh."""
        return float(self._compare(hulls_mm).outward.max())

    def _compare(self, hulls_mm: Sequence[np.ndarray]) -> _Comparison:
        """The comparison with some hulls: a search asks for the last few again, with other bounds."""
        key = b"".join(np.asarray(points, dtype=np.float64).tobytes() for points in hulls_mm)
        found = self._compared.pop(key, None) or _Comparison(self, _Union(hulls_mm, self._step))
        self._compared[key] = found
        if len(self._compared) > _KEPT:
            del self._compared[next(iter(self._compared))]
        return found


class _Comparison:
    """Distances between a mesh and the union of some hulls, computed when they are asked for."""

    def __init__(self, mesh: MeshSurface, union: _Union) -> None:
        self.union = union
        self._mesh = mesh

    @cached_property
    def outward(self) -> np.ndarray:
        """Distance from the union's samples to the mesh."""
        return self._mesh.surface.distance_to(self.union.samples)

    @cached_property
    def fit(self) -> HullFit:
        """Measures of both directions."""
        mesh, union, outward = self._mesh, self.union, self.outward
        inward = _Surface(union.triangles).distance_to(mesh.samples)
        return HullFit(
            largest=float(max(outward.max(), inward.max())),
            p95=_p95(np.concatenate([outward, inward]), np.concatenate([union.areas, mesh.areas])),
            volume_ratio=float(union.volume / mesh.volume),
            outward_largest=float(outward.max()),
            outward_p95=_p95(outward, union.areas),
            inward_largest=float(inward.max()),
            inward_p95=_p95(inward, mesh.areas),
        )


class _Union:
    """Refined outer surface of the union of several hulls."""

    def __init__(self, hulls_mm: Sequence[np.ndarray], step: float) -> None:
        body = Manifold.batch_boolean(
            [Manifold.hull_points(np.asarray(points, dtype=np.float64)) for points in hulls_mm], OpType.Add
        )
        self.volume = float(body.volume())
        self.triangles = _outer_triangles(_triangles(body.refine_to_length(step)), hulls_mm)
        self.samples, self.areas = _samples(self.triangles)


class _Surface:
    """A finely cut surface, sorted by the centres of its triangles (n, 3, 3)."""

    def __init__(self, triangles: np.ndarray) -> None:
        self.triangles = triangles
        centres = triangles.mean(axis=1)
        self._radius = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
        self._tree = KDTree(centres)

    def distance_to(self, points: np.ndarray) -> np.ndarray:
        """Distance of points (n, 3)."""
        distance = self._by_nearest(points, 8)
        # Among slivers the eight nearest centres may be of farther triangles: large ones are checked again.
        doubtful = np.flatnonzero(distance > max(float(np.quantile(distance, 0.9)), 0.01))
        if len(doubtful):
            distance[doubtful] = self._by_nearest(points[doubtful], 64)
        return distance

    def _by_nearest(self, points: np.ndarray, count: int) -> np.ndarray:
        """Distance to the triangles whose centres are nearest."""
        count = min(count, len(self.triangles))
        distances, nearest = (
            np.reshape(one, (len(points), count)) for one in self._tree.query(points, k=count)
        )
        best = np.full(len(points), np.inf)
        for distance, column in zip(distances.T, nearest.T, strict=True):
            # A triangle is no nearer than its centre less its radius.
            rows = np.flatnonzero(distance - self._radius[column] < best)
            if len(rows):
                closest = trimesh.triangles.closest_point(self.triangles[column[rows]], points[rows])
                best[rows] = np.minimum(best[rows], np.linalg.norm(closest - points[rows], axis=1))
        return best


def _p95(distance: np.ndarray, area: np.ndarray) -> float:
    """The distance within which 95 % of the area is."""
    order = np.argsort(distance)
    covered = np.cumsum(area[order]) / area.sum()
    return float(distance[order][min(int(np.searchsorted(covered, 0.95)), len(distance) - 1)])


def aspect_ratio(points: np.ndarray) -> float:
    """Length of a convex body divided by its least thickness."""
    return _aspect_ratio(np.ascontiguousarray(points, dtype=np.float64).tobytes())


@lru_cache(maxsize=4096)
def _aspect_ratio(coordinates: bytes) -> float:
    """The same; a search of pieces asks for it again and again of those that it leaves alone."""
    points = np.frombuffer(coordinates).reshape(-1, 3)
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    heights = corners @ hull.equations[:, :3].T
    thickness = (heights.max(axis=0) - heights.min(axis=0)).min()
    length = np.linalg.norm(corners[:, None] - corners[None], axis=-1).max()
    return float(length / thickness)


def _triangles(body: Manifold) -> np.ndarray:
    data = body.to_mesh64()
    return np.asarray(data.vert_properties)[:, :3][np.asarray(data.tri_verts)]


def _outer_triangles(triangles: np.ndarray, hulls: Sequence[np.ndarray]) -> np.ndarray:
    """The triangles without a hull in front of them.

    Hulls that share a face differ by rounding, so their union keeps both sides of it as an inner wall.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    # Coordinates first: numpy reduces many rows of three numbers slowly.
    in_front = np.ascontiguousarray((triangles.mean(axis=1) + 0.01 * normal).T)
    covered = np.zeros(len(triangles), dtype=bool)
    for points in hulls:
        planes = ConvexHull(points).equations
        # Most triangles are outside the hull's box, and covered ones need no second test.
        low, high = points.min(axis=0) - 1e-6, points.max(axis=0) + 1e-6
        in_box = ((in_front >= low[:, None]) & (in_front <= high[:, None])).all(axis=0)
        near = np.flatnonzero(in_box & ~covered)
        heights = planes[:, :3] @ in_front[:, near] + planes[:, 3:]
        covered[near] = (heights < 0).all(axis=0)
    return triangles[~covered]


def _samples(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on the surface (centres, and corners without weight) and the area that each represents."""
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    stride = -(-len(triangles) // (MOST_SAMPLES // 2))
    chosen = triangles[::stride]
    points = np.concatenate([chosen.mean(axis=1), chosen[:, 0]])
    return points, np.concatenate([area[::stride], np.zeros(len(chosen))])
