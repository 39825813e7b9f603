"""Part prepared for the search for its pose: its surface, looks from above, and symmetries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.parts import Part
from mskgrasp.perception.part_pose.surface import HeightMap, Surface, heights_from

MOST_CELLS = 300e3
"""Greatest area of a part's surface, in cells."""
LEAST_CELL = 0.2e-3
"""Least edge of a cell, metres: a tenth of the pixel of a Kinect v2 at 0.8 m."""
SAME_HEIGHT = 0.3e-3
"""Heights that differ by less, beside a step between neighbouring cells, are the same, metres."""
SAME_AREA = 3e-6
"""A turned part that differs over less than this, square metres, looks the same: a pixel covers 4.8 mm^2."""
SAME_SHARE = 0.003
"""The same, as a share of the part's area."""
HIDDEN_AREA = 1e-6
"""A turned part that differs over more than this, square metres, on its top or its underside is not the
same, even if the camera cannot tell."""
SIMILAR_HEIGHT, SIMILAR_AREA, SIMILAR_SHARE = 0.5e-3, 6e-6, 0.04
"""The same for resting poses that are looked for together at first."""
MOST_ORDERS = 72
"""Greatest order of symmetry other than a full one."""
MOST_RIVALS, RIVAL_SHARE, RIVAL_APART = 4, 0.3, np.radians(9)
"""So many other turns, so far apart, at which a part nearly looks the same: less of its area differs."""
_BESIDE = 5
"""Degrees within which there is none that looks more alike."""
MOST_COMPARED = 12
"""Similar resting poses that are distinguished; more of them are facets of a body of revolution."""
_STEEPEST_DOWN = -0.3
"""Upward component of the normals of faces that look farther down, which no camera straight above sees: at
0.8 m a part is at most 0.2 m off the axis."""


@dataclass(frozen=True, kw_only=True)
class Lying:
    """A part in one of its resting poses.

    Its frame is on the table under the origin of obj, with the axes of the table in ``T_table_obj``.

    Attributes:
        resting: Index of the resting pose.
        probability: Of the resting pose.
        turn: The first of those that look alike must be turned by this to look like this one, radians.
        surface: That a camera above may see; None where it is not compared with others that look alike.
        order: Number of turns that look the same; 0: all.
        symmetric: Whether these turns leave the part the same; otherwise a detail tells them apart that is
            too small for the camera, or on the underside.
    """

    resting: int
    probability: float
    turn: float
    surface: Surface | None
    order: int
    symmetric: bool

    @property
    def period(self) -> float:
        """Angle by which the part must be turned to look the same again, radians; 0 where any turn does."""
        return 2 * np.pi / self.order if self.order else 0.0


@dataclass(frozen=True, kw_only=True)
class Look:
    """Resting poses that look alike from above, up to a turn.

    Attributes:
        poses: The most probable first; its frame and surface are those of the look.
        outline: (k, 2) corners of the convex hull of x, y of its vertices, metres.
        from_above: Heights of it as seen from straight above.
        top: Height of the highest point, metres.
        radius: Greatest distance of a vertex from the vertical through the part's origin, metres.
        rivals: Turns at which it nearly looks the same, radians: by a tooth of a gear with holes, or by half
            a turn of a plate with holes at one end.
    """

    poses: tuple[Lying, ...]
    outline: np.ndarray
    from_above: HeightMap
    top: float
    radius: float
    rivals: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class KnownPart:
    """A part whose pose can be found.

    Attributes:
        part: The part.
        cell: Edge of the cells of its height maps, metres.
        looks: Its resting poses, by how they look from above.
    """

    part: Part
    cell: float
    looks: tuple[Look, ...]

    @classmethod
    def of(cls, part: Part, stands: Sequence[bool] | None = None) -> KnownPart:
        """Prepare a part; takes up to some seconds.

        Args:
            part: The part.
            stands: Of each resting pose, whether it is looked for (`mskgrasp.simulation.resting.resting_of`);
                None: all are.

        Raises:
            ValueError: No resting pose is looked for.
        """
        mesh = trimesh.load_mesh(part.mesh_path)
        surface = Surface(
            vertices=np.asarray(mesh.vertices, dtype=float), faces=np.asarray(mesh.faces, dtype=np.int32)
        )
        cell = max(LEAST_CELL, float(np.sqrt(mesh.area / MOST_CELLS)))
        groups: list[list[tuple[_Seen, float]]] = []
        chosen = [i for i in range(len(part.resting_probability)) if stands is None or stands[i]]
        if not chosen:
            raise ValueError(f"no resting pose of {part.name} counts")
        for index in chosen:
            seen = _Seen.of(part, index, surface, cell)
            for group in groups:
                turn = group[0][0].turn_to(seen)
                if turn is not None:
                    group.append((seen, turn))
                    break
            else:
                groups.append([(seen, 0.0)])

        def symmetric(seen: _Seen, order: int) -> bool:
            under = _Seen.of(part, seen.resting, surface, cell, from_below=True)
            return seen.symmetric(order) and under.symmetric(order)

        return cls(part=part, cell=cell, looks=tuple(_look(group, symmetric) for group in groups))

    @property
    def least_top(self) -> float:
        """Height of the highest point of the part as it lies flattest, metres."""
        return min(look.top for look in self.looks)

    def pose(self, lying: Lying, x: float, y: float, turn: float, table_z: float) -> Pose:
        """``T_base_obj`` of the part at a place and turn of the frame of a resting pose."""
        place = Pose(position=np.array([x, y, table_z]), quat_wxyz=quat_about_z(np.asarray(turn)))
        return place @ self.part.resting[lying.resting]


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """A resting pose before it is known which others look alike."""

    resting: int
    probability: float
    surface: Surface
    from_above: HeightMap
    lower: np.ndarray
    upper: np.ndarray
    cells: np.ndarray
    levels: np.ndarray

    @classmethod
    def of(cls, part: Part, index: int, surface: Surface, cell: float, *, from_below: bool = False) -> _Seen:
        lying = surface.rotated(part.resting.quat_wxyz[index], part.resting.position[index, 2])
        if from_below:
            lying = lying.rotated(np.array([0.0, 1.0, 0.0, 0.0]), float(lying.vertices[:, 2].max()))
        lying = lying.facing(_STEEPEST_DOWN)
        from_above = heights_from(lying, None, plane=0.0, cell=cell, margin=3 * cell)
        lower, upper = from_above.bounds(cell)
        rows, columns = np.mgrid[: lower.shape[0], : lower.shape[1]]
        return cls(
            resting=index,
            probability=float(part.resting_probability[index]),
            surface=lying,
            from_above=from_above,
            lower=lower,
            upper=upper,
            cells=np.stack([columns.ravel(), rows.ravel()], axis=-1) * cell + from_above.corner,
            levels=from_above.heights.ravel(),
        )

    @property
    def area(self) -> float:
        return float(np.count_nonzero(self.levels)) * self.from_above.cell**2

    def differs(self, other: _Seen, turn: float, tolerance: float, every: int = 1) -> float:
        """Area of another's cells whose height is not found here after a turn, square metres."""
        at, levels = self._where(other, turn, every), other.levels[::every]
        bad = (levels < self.lower[at] - tolerance) | (levels > self.upper[at] + tolerance)
        return float(np.count_nonzero(bad)) * every * other.from_above.cell**2

    def distance(self, other: _Seen, turn: float, every: int) -> float:
        """Mean difference of heights after a turn, metres, large ones clipped."""
        off = np.abs(self.from_above.heights[self._where(other, turn, every)] - other.levels[::every])
        return float(np.minimum(off, 2e-3).mean())

    def _where(self, other: _Seen, turn: float, every: int) -> tuple[np.ndarray, np.ndarray]:
        """Row and column here of another's cells after a turn."""
        cos, sin = np.cos(turn), np.sin(turn)
        cells = other.cells[::every]
        x, y = cos * cells[:, 0] + sin * cells[:, 1], cos * cells[:, 1] - sin * cells[:, 0]
        column = np.rint((x - self.from_above.corner[0]) / self.from_above.cell).astype(int)
        row = np.rint((y - self.from_above.corner[1]) / self.from_above.cell).astype(int)
        inside = (column >= 0) & (row >= 0) & (column < self.lower.shape[1]) & (row < self.lower.shape[0])
        return np.where(inside, row, 0), np.where(inside, column, 0)  # the border is empty

    def turn_to(self, other: _Seen) -> float | None:
        """The turn after which this looks like another; None where there is none."""
        if abs(self.levels.max() - other.levels.max()) > SIMILAR_HEIGHT:
            return None
        allowed = self.allowed(True)
        if abs(self.area - other.area) > 2 * allowed:
            return None
        every = max(1, len(other.levels) // 700)
        turns = np.arange(0, 2 * np.pi, np.radians(2))
        areas = np.array([self.differs(other, turn, SIMILAR_HEIGHT, every) for turn in turns])
        for best in turns[np.argsort(areas)[:4]]:
            for step in np.radians([0.4, 0.08]):
                near = best + step * np.arange(-6, 7)
                best = near[np.argmin([self.distance(other, turn, max(1, every // 6)) for turn in near])]
            if self.differs(other, best, SIMILAR_HEIGHT) <= allowed:
                return float(best)
        return None

    def order(self, similar: bool) -> int:
        """Number of turns that look the same, or similar; 0: all."""
        every = max(1, len(self.levels) // 3000)
        if all(self._same_at(turn, similar, every) for turn in np.radians(4 * np.arange(1, 90) + 0.5)):
            return 0
        return next((n for n in range(MOST_ORDERS, 1, -1) if self._repeats(n, similar, every)), 1)

    def _repeats(self, order: int, similar: bool, every: int) -> bool:
        turns = np.arange(1, order // 2 + 1) * 2 * np.pi / order
        return all(self._same_at(t, similar, every, 2.0) for t in turns) and all(
            self._same_at(t, similar, 1) for t in turns
        )

    def symmetric(self, order: int) -> bool:
        """Whether nothing on this side tells the turns of a symmetry apart, all multiples of the first."""
        turns = [2 * np.pi / order] if order else np.radians([40.5, 97.0, 161.0])
        return all(self.differs(self, turn, SAME_HEIGHT) <= HIDDEN_AREA for turn in turns)

    def rivals(self, order: int) -> tuple[float, ...]:
        """Turns within the period of a symmetry at which it nearly looks the same, the likest first."""
        if not order:
            return ()
        period, every = 2 * np.pi / order, max(1, len(self.levels) // 3000)
        turns = np.linspace(0, period, max(3, round(np.degrees(period))), endpoint=False)
        shares = np.array([self.differs(self, turn, SIMILAR_HEIGHT, every) for turn in turns]) / self.area
        steps = range(-_BESIDE, _BESIDE + 1)
        least = shares <= np.min([np.roll(shares, step) for step in steps], axis=0)
        found = [0.0]
        for turn, share in sorted(
            zip(turns[least].tolist(), shares[least].tolist(), strict=True), key=lambda one: one[1]
        ):
            off = np.abs((np.array(found) - turn + period / 2) % period - period / 2)
            if share < RIVAL_SHARE and off.min() > RIVAL_APART and len(found) <= MOST_RIVALS:
                found.append(turn)
        return tuple(found[1:])

    def _same_at(self, turn: float, similar: bool, every: int, slack: float = 1.0) -> bool:
        height = SIMILAR_HEIGHT if similar else SAME_HEIGHT
        return self.differs(self, turn, height, every) <= slack * self.allowed(similar)

    def allowed(self, similar: bool) -> float:
        """Area over which what looks the same, or similar, may differ, square metres."""
        if similar:
            return max(SIMILAR_AREA, SIMILAR_SHARE * self.area)
        return max(SAME_AREA, SAME_SHARE * self.area)


def _look(group: list[tuple[_Seen, float]], symmetric: Callable[[_Seen, int], bool]) -> Look:
    first, poses = group[0][0], []
    compared = len(group) <= MOST_COMPARED
    for seen, turn in group:
        order = seen.order(similar=not compared) if compared or seen is first else poses[0].order
        poses.append(
            Lying(
                resting=seen.resting,
                probability=seen.probability,
                turn=turn,
                surface=seen.surface if compared or seen is first else None,
                order=order,
                # Facets of a body of revolution, which are not compared, are the same but for the facets.
                symmetric=order == 1 or not compared or symmetric(seen, order),
            )
        )
    visible = first.surface.vertices
    return Look(
        poses=tuple(poses),
        outline=cv2.convexHull(visible[:, :2].astype(np.float32))[:, 0],
        from_above=first.from_above,
        top=float(visible[:, 2].max()),
        radius=float(np.linalg.norm(visible[:, :2], axis=1).max()),
        rivals=first.rivals(poses[0].order),
    )
