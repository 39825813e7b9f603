"""Pipe fittings with legs: tees and elbows with beads, barbs or nuts at their ends."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold, OpType

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import BRASS, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.pieces import split_by

MALLEABLE_IRON = 7350.0
STAINLESS = 7900.0


def recipes() -> Iterator[Recipe]:
    """The built-in fittings with legs."""
    yield from one_per_row("pipe_tee.csv", "pipe_tee_{d}x{l}x{m}", pipe_tee, density=MALLEABLE_IRON)
    yield from one_per_row("pipe_elbow.csv", "pipe_elbow_{angle}_{d}x{l}", pipe_elbow, density=MALLEABLE_IRON)
    yield from one_per_row("hose_elbow.csv", "hose_elbow_{d}x{l}", hose_elbow, density=BRASS)
    yield from one_per_row("hose_tee.csv", "hose_tee_{d}x{l}", hose_tee, density=POLYAMIDE)
    yield from one_per_row("nut_elbow.csv", "nut_elbow_{d}x{l}", nut_elbow, density=STAINLESS)
    yield from one_per_row("nut_tee.csv", "nut_tee_{d}x{l}", nut_tee, density=STAINLESS)


def pipe_tee(size: dict[str, float]) -> s.Solid:
    """A run along x, a branch along z, a bead around every end."""
    leg, branch = _beaded(size, size["l_mm"]), _beaded(size, size["m_mm"])
    return _tee(leg, branch, size["bore_mm"] / 2).solid()


def pipe_elbow(size: dict[str, float]) -> s.Solid:
    """Two beaded legs that bend the pipe by an angle of 45 or 90 degrees."""
    leg = _beaded(size, size["l_mm"])
    return _elbow(leg, leg, size["angle"], size["d_mm"] / 2, size["bore_mm"] / 2).solid()


def hose_elbow(size: dict[str, float]) -> s.Solid:
    """A barbed tail and a plain stub for a thread."""
    body, bore, thread = size["body_mm"] / 2, size["bore_mm"] / 2, size["thread_mm"] / 2
    stub = h.tool(o.tube(thread, bore, 0, size["m_mm"]).body, o.hollow(bore, thread, 0, size["m_mm"]))
    return _elbow(stub, _barbed(size), 90, max(body, thread), bore).solid()


def hose_tee(size: dict[str, float]) -> s.Solid:
    """Three barbed tails of one size."""
    tail = _barbed(size)
    return _tee(tail, tail, size["bore_mm"] / 2).solid()


def nut_elbow(size: dict[str, float]) -> s.Solid:
    """A tube elbow with a hexagonal union nut on either leg."""
    leg = _nutted(size)
    return _elbow(leg, leg, 90, size["d_mm"] / 2, size["bore_mm"] / 2).solid()


def nut_tee(size: dict[str, float]) -> s.Solid:
    """A tube tee with a hexagonal union nut on each leg."""
    leg = _nutted(size)
    return _tee(leg, leg, size["bore_mm"] / 2).solid()


def _beaded(size: dict[str, float], length: float) -> h.Shape:
    radius, bead, bore = size["d_mm"] / 2, size["bead_mm"] / 2, size["bore_mm"] / 2
    start = length - size["c_mm"]
    body = s.lathe([(bore, 0), (radius, 0), (radius, start), (bead, start), (bead, length), (bore, length)])
    return h.tool(body, o.hollow(bore, radius, 0, length) + o.collar(bore, radius, bead, start, length))


def _barbed(size: dict[str, float]) -> h.Shape:
    """A hose tail along z: the body, then saw teeth, which are a smooth tail in the hulls.

    The sharp side of each tooth faces the body, so that a hose slips on but not off.
    """
    tail, bore, body = size["d_mm"] / 2, size["bore_mm"] / 2, size["body_mm"] / 2
    length, barbs = size["l_mm"], int(size["barbs"])
    start = 1.3 * body
    pitch = (length - start) / barbs
    profile = [(bore, 0.0), (body, 0.0), (body, start)]
    for n in range(barbs):
        z = start + n * pitch
        profile += [(0.96 * tail, z), (1.08 * tail, z), (0.96 * tail, z + pitch)]
    hulls = o.hollow(bore, 1.02 * tail, 0, length) + o.collar(bore, 1.02 * tail, body, 0, start)
    return h.tool(s.lathe([*profile, (bore, length)]), hulls)


def _nutted(size: dict[str, float]) -> h.Shape:
    """A tube along z with a hexagonal nut a little before its end."""
    tube, bore, length = size["d_mm"] / 2, size["bore_mm"] / 2, size["l_mm"]
    end = 0.86 * length
    start = end - size["m_mm"]
    body = o.tube(tube, bore, 0, length).body + s.extrude(
        s.hexagon(size["s_mm"]), start, end, [s.circle(0.9 * tube)]
    )
    nut = o.hexagonal_collar(tube, size["s_mm"], start, end)
    return h.tool(body, o.hollow(bore, tube, 0, length) + nut)


def _tee(leg: h.Shape, branch: h.Shape, bore: float) -> h.Shape:
    """A run of two equal legs along x and a branch along z; both are given along z."""
    legs = {90.0: leg, -90.0: leg, 0.0: branch}
    bodies = [shape.turned("y", angle).body for angle, shape in legs.items()]
    holes = [o.bore(bore, 0, 500).turned("y", angle).body for angle in legs]
    body = Manifold.batch_boolean(bodies, OpType.Add)
    run = [piece for angle in (90, -90) for piece in leg.turned("y", angle).hulls]
    # A box represents the opening in the wall of the run; the branch covers the corners that it leaves.
    opening = s.box(-0.9 * bore, 0.9 * bore, -0.8 * bore, 0.8 * bore, 0, 500)
    hulls = [part for piece in run for part in split_by(piece, opening)]
    hulls += s.cut(branch.hulls, [np.array([0.0, 0.0, -1.0])], [-bore])
    return h.tool(body - Manifold.batch_boolean(holes, OpType.Add), hulls)


def _elbow(first: h.Shape, second: h.Shape, bend: float, radius: float, bore: float) -> h.Shape:
    """Two legs along z, given from z = 0, led along x and against the bend; a sphere rounds the corner.

    The hulls meet on the mitre plane, and a plane represents the sphere.
    """
    angle = np.radians(180 - bend)
    directions = [np.array([1.0, 0, 0]), np.array([np.cos(angle), 0, np.sin(angle)])]
    middle = directions[0] + directions[1]
    between = middle / np.linalg.norm(middle)
    across = (directions[0] - directions[1]) / np.linalg.norm(directions[0] - directions[1])
    reach = radius / np.tan(angle / 2)
    corner = h.tool(Manifold(), o.hollow(bore, radius, -reach, 0))
    bodies, holes, hulls = [], [], []
    for leg, turn, side in ((first, 90.0, -across), (second, 90.0 - (180 - bend), across)):
        turned = leg.turned("y", turn)
        extended = [*turned.hulls, *corner.turned("y", turn).hulls]
        hulls += [piece for piece in s.cut(extended, [side, -between], [0.0, radius]) if len(piece) > 3]
        bodies.append(turned.body)
        holes.append(o.bore(bore, 0, 500).turned("y", turn).body)
    bodies.append(Manifold.sphere(radius, s.CIRCLE_SEGMENTS))
    holes.append(Manifold.sphere(bore, s.CIRCLE_SEGMENTS))
    body = Manifold.batch_boolean(bodies, OpType.Add) - Manifold.batch_boolean(holes, OpType.Add)
    return h.tool(body, hulls)
