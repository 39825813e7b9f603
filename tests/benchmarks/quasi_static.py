"""Quasi-static motion of a flat part that a point pushes over a table.

The part moves so slowly that its inertia does not count: the pusher's force balances the friction of the
table, which at each point of the support is mu times the pressure there and opposes the motion (Goyal, Ruina
and Papadopoulos, Planar sliding with dry friction, Wear 143, 1991; Lynch and Mason, Stable pushing,
IJRR 15, 1996). The contact sticks if its force lies in the friction cone, and else slides at the cone's edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import fminbound, least_squares

_STEPS = 100
_REST = 1e-9
"""Points of the support slower than this share of the pusher's speed count as in transition to rest."""


@dataclass(frozen=True, kw_only=True)
class Push:
    """A wall's vertical edge that moves in -y and pushes the upper face of a rectangle.

    Attributes:
        support: (n, 2) points of the part that carry it, in its own frame from its centre of mass, metres.
        weight: (n,) share of the weight that each carries.
        mu: Coulomb coefficient of pusher and part; that of the table has no effect.
        half_thickness: Of the rectangle, y of its upper face in its own frame, metres.
    """

    support: np.ndarray
    weight: np.ndarray
    mu: float
    half_thickness: float

    def run(self, start: np.ndarray, edge_x: float, way: float) -> np.ndarray:
        """Pose (x, y, angle) after the edge has pushed the part for a way in -y from their first contact."""
        pose, step = np.array(start, dtype=float), way / _STEPS
        guess = np.zeros(2)
        for _ in range(_STEPS):
            twist, guess = self._twist(pose, edge_x, guess)
            middle = pose + 0.5 * step * twist  # midpoint rule
            twist, guess = self._twist(middle, edge_x, guess)
            pose = pose + step * twist
        return pose

    def _twist(self, pose: np.ndarray, edge_x: float, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Motion (x, y, angle) a unit of the edge's way, and where to begin the next search."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        along, normal = np.array([c, s]), np.array([-s, c])
        edge = (self.half_thickness - (edge_x - pose[0]) * normal[0]) / normal[1]
        contact = np.array([edge_x - pose[0], edge])
        points = self.support @ np.stack([along, normal])

        def motion(slip: float, turn: float) -> np.ndarray:
            velocity = np.array([0.0, -1.0]) + slip * along
            return np.array([velocity[0] + turn * contact[1], velocity[1] - turn * contact[0], turn])

        def wrench(slip: float, turn: float) -> tuple[np.ndarray, float]:
            """Force on the pusher over the friction of the whole weight, and its moment about the contact."""
            x, y, w = motion(slip, turn)
            velocity = np.stack([x - w * points[:, 1], y + w * points[:, 0]], axis=1)
            speed = np.sqrt((velocity**2).sum(axis=1) + _REST**2)
            force = self.weight[:, None] * velocity / speed[:, None]
            arm = points - contact
            return force.sum(axis=0), float((arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum())

        def dissipated(turn: float) -> float:
            x, y, w = motion(0.0, turn)
            return float(self.weight @ np.hypot(x - w * points[:, 1], y + w * points[:, 0]))

        scale = float(np.sqrt((self.support**2).sum(axis=1).mean()))
        turn = float(fminbound(dissipated, -2 / scale, 2 / scale, xtol=1e-10))
        force, _ = wrench(0.0, turn)
        pressing, sideways = -force @ normal, force @ along
        if abs(sideways) <= self.mu * pressing:
            return motion(0.0, turn), np.array([0.0, turn])
        side = np.sign(sideways)

        def off_the_edge(unknown: np.ndarray) -> np.ndarray:
            force, moment = wrench(unknown[0], unknown[1] / scale)
            return np.array([force @ along - side * self.mu * (-force @ normal), moment / scale])

        first = guess * [1, scale] if guess[0] else np.array([-side * 1e-3, turn * scale])
        found = least_squares(off_the_edge, first, xtol=1e-12, ftol=1e-14, gtol=1e-14).x
        return motion(found[0], found[1] / scale), found / [1, scale]


def rectangle(length: float, thickness: float, n: tuple[int, int] = (40, 10)) -> np.ndarray:
    """Points (n, 2) of a rectangle that carry it with even pressure."""
    x = (np.arange(n[0]) + 0.5) / n[0] * length - length / 2
    y = (np.arange(n[1]) + 0.5) / n[1] * thickness - thickness / 2
    return np.stack([axis.ravel() for axis in np.meshgrid(x, y)], axis=1)


def corners(length: float, thickness: float) -> np.ndarray:
    """The four corners (4, 2) of a rectangle; the last two lie opposite the first."""
    x, y = length / 2, thickness / 2
    return np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
