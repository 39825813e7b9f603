"""Convex decomposition of watertight meshes within an error bound, by CoACD.

CoACD: Wei et al., Approximate convex decomposition for 3D meshes with collision-aware concavity and tree
search, SIGGRAPH 2022.
"""

from __future__ import annotations

import io
import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.solids.measure import (
    MOST_ASPECT_RATIO,
    MOST_P95_MM,
    MOST_VOLUME_RATIO,
    HullFit,
    MeshSurface,
    aspect_ratio,
)
from mskgrasp.parts.solids.merging import merge_in_steps
from mskgrasp.parts.solids.solid import cut, few_corners

MOST_HULLS = 48

CONCAVITIES_MM = (2.0, 1.0, 0.5)
"""Concavity that CoACD may leave, tried in turn, in millimetres.

The first suffices for half of the built-in shapes. In millimetres, since a threshold relative to the size
would cut small parts more finely than large ones.
"""

CLOSE_P95_MM = 0.35
CLOSE_VOLUME_RATIO = 1.05
CLOSE_LARGEST_MM = 0.75
"""Bounds for joining exact pieces; the last is the largest distance of a hull outside the mesh."""

_SLACKS = (0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04)
"""Shares of the volume that joining may add, tried in turn."""

_MOST_AFTER_SPLITTING = 96
_SLIVER_MM = 0.2
CONVEX_RATIO = 1.001
_OVERLAP_MM = 0.1
_LOST_SHARE = 0.4


# It ends with the thread that waits for it (prctl 1: PR_SET_PDEATHSIG), also where that is killed.
_PROGRAM = """
import ctypes, io, json, os, signal, sys
import numpy as np
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
out = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # CoACD prints to standard output
import coacd
coacd.set_log_level("error")
mesh = np.load(io.BytesIO(sys.stdin.buffer.read()))
pieces = coacd.run_coacd(coacd.Mesh(mesh["vertices"], mesh["faces"]), **json.loads(sys.argv[1]))
written = io.BytesIO()
np.savez(written, *[points for points, _ in pieces])
out.write(written.getvalue())
out.close()
"""


def convex_pieces(mesh_mm: trimesh.Trimesh) -> tuple[np.ndarray, ...]:
    """Convex pieces of a watertight mesh; the same mesh always gives the same pieces.

    CoACD cuts more and more finely until the pieces are within ``MOST_P95_MM`` and ``MOST_VOLUME_RATIO``;
    then neighbours are joined as far as these bounds allow.

    Raises:
        BadPart: Pieces as fine as they may be are too far from the mesh, or too thin for PhysX.
    """
    # CoACD would search for concavity between the facets of a fine ball, for minutes.
    convex = mesh_mm.convex_hull.volume <= CONVEX_RATIO * mesh_mm.volume
    surface = MeshSurface(mesh_mm)
    tried: list[tuple[float, int, HullFit]] = []
    for concavity_mm in CONCAVITIES_MM:
        parts = [np.asarray(mesh_mm.vertices)] if convex else cut_up(mesh_mm, concavity_mm)
        for pieces in with_few_corners(parts, _LOST_SHARE * concavity_mm):
            fit = surface.fit(pieces)
            if _within(fit, MOST_P95_MM, MOST_VOLUME_RATIO):
                joined = _join(surface, pieces, MOST_P95_MM, MOST_VOLUME_RATIO, finish=split_slender)
                if len(joined) <= MOST_HULLS:
                    return tuple(joined)
            tried.append((fit.p95, len(pieces), fit))
        if len(parts) >= MOST_HULLS:
            break  # at the limit of pieces a finer cut is no closer, and takes minutes
    _, count, fit = min(tried, key=lambda item: item[0])
    raise BadPart(
        f"no small set of convex pieces represents the mesh: with {count} (at most {MOST_HULLS}), 95 % of "
        f"the surface is within {fit.p95:.2f} mm (at most {MOST_P95_MM} mm), volume ratio "
        f"{fit.volume_ratio:.2f} (at most {MOST_VOLUME_RATIO}): simplify fine detail such as threads, "
        "grilles and thin walls"
    )


def fewest_hulls(
    mesh_mm: trimesh.Trimesh, hulls: Sequence[np.ndarray], most_p95: float = CLOSE_P95_MM
) -> tuple[np.ndarray, ...]:
    """Exact pieces joined where that changes little.

    Args:
        mesh_mm: Mesh that the pieces represent, millimetres.
        hulls: Corners (n, 3) of each.
        most_p95: 95 % of the surface stay within this distance, mm; the bounds of the volume and of the
            largest distance are in proportion.
    """
    surface = MeshSurface(mesh_mm)
    share = most_p95 / CLOSE_P95_MM
    most_largest = np.inf  # more than PhysX should handle have to be joined at any distance
    if len(hulls) <= MOST_HULLS:
        # Holes that are filled on purpose count as distance already.
        most_largest = max(share * CLOSE_LARGEST_MM, surface.outward_largest(hulls) + 0.01)
    most_ratio = min(MOST_VOLUME_RATIO, 1 + share * (CLOSE_VOLUME_RATIO - 1))
    return tuple(_join(surface, hulls, most_p95, most_ratio, most_largest))


def cut_up(mesh_mm: trimesh.Trimesh, concavity_mm: float) -> list[np.ndarray]:
    """Pieces (n, 3) of CoACD, at most ``MOST_HULLS``, of this concavity where these suffice.

    Raises:
        BadPart: CoACD crashed, or was ended for lack of memory.
        RuntimeError: It cannot be run.
    """
    settings = dict(
        threshold=concavity_mm,
        real_metric=True,
        max_convex_hull=MOST_HULLS,
        preprocess_mode="off",  # remeshing is for open meshes, which are refused before
        # A third of the time of the defaults for the same number of hulls, measured on brackets and levers; a
        # depth under 3, or fewer nodes, gives twice the hulls and takes longer.
        resolution=1000,
        mcts_nodes=10,
        mcts_iterations=30,
        mcts_max_depth=3,
        seed=0,
    )
    # In a separate process: on walls that touch CoACD may crash, and would end this one.
    mesh = io.BytesIO()
    np.savez(mesh, vertices=np.asarray(mesh_mm.vertices), faces=np.asarray(mesh_mm.faces))
    done = subprocess.run(
        [sys.executable, "-P", "-c", _PROGRAM, json.dumps(settings)],
        input=mesh.getvalue(),
        capture_output=True,
        check=False,
    )
    if done.returncode > 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise RuntimeError(f"CoACD cannot be run: {said[-1] if said else done.returncode}")
    if done.returncode == -signal.SIGKILL:
        raise BadPart("CoACD, which cuts it into pieces, was killed: free memory, or export it coarser")
    if done.returncode:
        raise BadPart(
            f"CoACD, which cuts it into convex pieces, crashed (exit code {done.returncode}): repair its "
            "mesh where walls touch or coincide, or export it coarser"
        )
    with np.load(io.BytesIO(done.stdout)) as pieces:
        return [np.asarray(pieces[name], dtype=float) for name in pieces.files]


def with_few_corners(pieces: Sequence[np.ndarray], most_lost_mm: float) -> Iterator[list[np.ndarray]]:
    """Pieces with no more corners than PhysX accepts; where that loses much, again with those halved.

    A ball is one convex piece, but with 32 corners it loses 6 % of its diameter.
    """
    # CoACD's own decimation cuts 6.7 mm off the ends of a bent round bar, where this loses 1.8 mm.
    few = [few_corners(points) for points in pieces]
    yield few
    pending, close = list(zip(pieces, few, strict=True)), []
    if all(_lost_mm(points, kept) <= most_lost_mm for points, kept in pending):
        return
    while pending and len(pending) + len(close) <= _MOST_AFTER_SPLITTING:
        points, kept = pending.pop(0)
        if _lost_mm(points, kept) <= most_lost_mm:
            close.append(kept)
        else:
            # Halves that lose corners along the cut would leave a gap between them.
            pending += [(half, few_corners(half)) for half in _halves(points, _OVERLAP_MM)]
    yield close + [kept for _, kept in pending]


def _lost_mm(points: np.ndarray, kept: np.ndarray) -> float:
    """Largest distance of the points outside the hull of those that were kept."""
    planes = ConvexHull(kept).equations
    return float((points @ planes[:, :3].T + planes[:, 3]).max())


def _join(
    surface: MeshSurface,
    hulls: Sequence[np.ndarray],
    most_p95: float,
    most_ratio: float,
    most_largest: float = np.inf,
    *,
    finish: Callable[[list[np.ndarray]], list[np.ndarray]] = list,
) -> list[np.ndarray]:
    """Pieces joined with the largest slack within the bounds; unchanged where none is.

    ``finish`` is applied last: joining absorbs slivers that it would have to cut.
    """
    best: list[np.ndarray] | None = None
    # Pieces that are slender from the start stay so; ``finish`` cuts them.
    most_slender = max([0.9 * MOST_ASPECT_RATIO, *(aspect_ratio(points) for points in hulls)])
    steps = merge_in_steps(hulls, _SLACKS)
    low, high, middle = 0, len(_SLACKS), len(_SLACKS) - 1
    while low < high:
        # The largest slack first, which fits most parts, then bisection.
        joined = steps[middle]
        if len(joined) == len(hulls):
            low, middle = middle + 1, (middle + 1 + high) // 2
            continue
        joined = finish(joined)
        close = max(aspect_ratio(points) for points in joined) <= most_slender
        if close and surface.fit_within(joined, most_p95, most_ratio, most_largest) is not None:
            best, low = joined, middle + 1
        else:
            high = middle
        middle = (low + high) // 2
    return finish(list(hulls)) if best is None else best


def _within(fit: HullFit, most_p95: float, most_ratio: float) -> bool:
    return fit.p95 <= most_p95 and 1 / most_ratio <= fit.volume_ratio <= most_ratio


def split_slender(pieces: Sequence[np.ndarray], most: int = _MOST_AFTER_SPLITTING) -> list[np.ndarray]:
    """Pieces cut across their length until PhysX on a GPU accepts them.

    Raises:
        BadPart: There would be too many.
    """
    pending, done = list(pieces), []
    while pending:
        points = pending.pop(0)
        ratio = aspect_ratio(points)
        if np.linalg.norm(np.ptp(points, axis=0)) / ratio < _SLIVER_MM:
            continue  # a remainder between two cuts; the fit is measured without it
        if ratio <= 0.9 * MOST_ASPECT_RATIO:
            done.append(points)
        elif len(done) + len(pending) < most:
            pending += _halves(points)
        else:
            raise BadPart(
                f"the part is too thin: over {most} hulls would be needed to keep each "
                f"hull's length under {MOST_ASPECT_RATIO:.0f} times its thickness; make thin walls thicker"
            )
    return done


def _halves(points: np.ndarray, overlap: float = 0.0) -> list[np.ndarray]:
    """A convex piece cut across its greatest length; the halves may share a slice of some thickness."""
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    along = points @ axes[0]
    middle = float(along.min() + along.max()) / 2
    return [cut([points], [sign * axes[0]], [sign * middle + overlap / 2])[0] for sign in (1, -1)]
