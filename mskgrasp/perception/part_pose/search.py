"""Search for the poses whose heights, seen by the camera, fit those of an image best."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from mskgrasp.perception.part_pose.known_part import MOST_COMPARED, KnownPart, Look, Lying
from mskgrasp.perception.part_pose.likelihood import ExactHeights, HeightTable, Pixels, Seen, view
from mskgrasp.perception.part_pose.surface import HeightMap

MODES = 16
"""Turns and looks that are fitted roughly."""
LOOK_MODES = 6
"""The most of one look."""
HOPELESS = 300.0
"""Fits whose cost exceeds the least by more are given up. In 360 images of validation parts the poses found
are the same to the bit without this bound, and take 1.4 times as long."""
MOST_REFINED, NEAR_COST = 3, 30.0
"""So many resting poses of a look are refined at the end, if their cost exceeds the least by less."""
_TRIED, _SETTLED = 1.6, 0.4
"""First and final fits at nearer turns are the same, in turns between neighbouring tries."""
_DEPENDS_WITHIN = 1.5
"""A pixel's height depends on the pose where heights differ within so many pixels."""


@cache
def _normals() -> np.ndarray:
    """(64, 3) of a standard normal, the first in the middle."""
    from scipy.stats import qmc  # takes most of a second to import

    normals = qmc.MultivariateNormalQMC(np.zeros(3), rng=np.random.default_rng(0)).random(64)
    normals[0] = 0.0
    return normals


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A pose with its cost.

    Attributes:
        look: The look of the resting pose.
        lying: The resting pose.
        pose: (3,) x, y in base, metres, and turn of the resting pose's frame, radians.
        covariance: (3, 3) of them.
        cost: Negative logarithm of the likelihood of all pixels, less that of the resting pose's probability.
        pixel_costs: (n,) of every pixel; none in a first fit.
    """

    look: Look
    lying: Lying
    pose: np.ndarray
    covariance: np.ndarray
    cost: float
    pixel_costs: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How thoroughly a fit is improved.

    Attributes:
        rounds: Number of times that poses are drawn, around the mean of those before.
        draws: Number of poses a round, at most 64.
        pixels: Greatest number of pixels.
        reach: Deviation of the first poses of a round, metres.
        coarse: How many times as large as the finest the cells of the map are.
        exact: Whether edges are sharp, and the cost is that of the heights that the pixels see exactly.
    """

    rounds: int
    draws: int
    pixels: int
    reach: float
    coarse: float
    exact: bool = False


ROUGH = Effort(rounds=2, draws=24, pixels=200, reach=1.5e-3, coarse=3)
CLOSER = Effort(rounds=2, draws=32, pixels=400, reach=0.8e-3, coarse=3)
CLOSE = Effort(rounds=2, draws=48, pixels=600, reach=0.5e-3, coarse=1.5)
FINAL = Effort(rounds=3, draws=64, pixels=1000, reach=0.2e-3, coarse=1, exact=True)


def search(seen: Seen, known: KnownPart) -> list[Fit]:
    """Find the poses that fit an image, the best first."""
    fits = _hopeful(_best(_coarse(seen, known), MODES + len(known.looks) // 2))
    n_looks = len(known.looks)  # of many some differ little
    for effort, n in ((ROUGH, 6 + n_looks // 3), (CLOSER, 3 + n_looks // 4), (CLOSE, 2 + n_looks // 8)):
        fits = _hopeful(_best([improve(fit, seen, known, effort) for fit in fits], n))
    found = []
    for fit in [*_turned(fits[0], seen, known), *fits[1:]]:
        likely = _resting_poses(fit, seen)
        near = [one for one in likely[:MOST_REFINED] if one.cost < likely[0].cost + NEAR_COST]
        found += [improve(one, seen, known, FINAL) for one in near]
    return _best(found, len(found), apart=_SETTLED)


def _turned(fit: Fit, seen: Seen, known: KnownPart) -> list[Fit]:
    """A fit, and the same turned to where the part nearly looks the same, if that may be better."""
    rivals = [replace(fit, pose=fit.pose + [0.0, 0.0, turn]) for turn in fit.look.rivals]
    fits = [fit, *(improve(rival, seen, known, CLOSE) for rival in rivals)]
    least = min(one.cost for one in fits)
    return sorted((one for one in fits if one.cost < least + NEAR_COST), key=lambda one: one.cost)


def _coarse(seen: Seen, known: KnownPart) -> list[Fit]:
    """All looks at all turns, the middle of the part where its pixels' is, as if seen from straight above."""
    chosen = np.concatenate([_some(np.flatnonzero(which), 120) for which in (seen.on_part, ~seen.on_part)])
    pixels = Pixels.of(seen, None, seen.centre).take(chosen)
    found = []
    for look in known.looks:
        turns = np.arange(0, look.poses[0].period or 1.0, _turn_step(look) if look.poses[0].order else 1.0)
        cos, sin = np.cos(turns)[:, None], np.sin(turns)[:, None]
        x, y = look.outline.T
        along, across = cos * x - sin * y, sin * x + cos * y
        low = np.stack([along.min(axis=1), across.min(axis=1)], axis=-1)
        high = np.stack([along.max(axis=1), across.max(axis=1)], axis=-1)
        # Of a narrow part in a noisy image an end may be missing, so that the other ends coincide.
        shifts = np.maximum(seen.pitch, np.abs(high - low - seen.size) / 2)
        steps = np.linspace(-1, 1, 3 if shifts.max() < 4 * seen.pitch else 5)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        places = seen.centre + grid * shifts[:, None] - (low + high)[:, None] / 2
        poses = np.concatenate(
            [places, np.broadcast_to(turns[:, None, None], (*places.shape[:2], 1))], axis=-1
        )
        from_above = look.from_above.padded(seen.pitch)
        table = HeightTable(from_above, sigma=max(seen.sigma, 1e-3), soft=seen.pitch, flying=0.0)
        costs = table.costs(pixels, poses.reshape(-1, 3)).sum(axis=1).reshape(len(turns), -1)
        best = costs.argmin(axis=1)
        found += [
            Fit(
                look=look,
                lying=look.poses[0],
                pose=poses[i, k],
                covariance=np.zeros((3, 3)),
                cost=float(costs[i, k]),
            )
            for i, k in enumerate(best)
        ]
    return found


def _some(index: np.ndarray, most: int) -> np.ndarray:
    return index[:: max(1, int(np.ceil(len(index) / most)))]


def _turn_step(look: Look) -> float:
    """Turn between neighbouring tries, radians: two pixels at the part's end."""
    return float(np.clip(4e-3 / look.radius, np.radians(3), np.radians(8)))


def _best(fits: list[Fit], n: int, apart: float = _TRIED) -> list[Fit]:
    """The best fits of which no two are nearly the same, by so many turns between tries."""
    kept: list[Fit] = []
    for fit in sorted(fits, key=lambda fit: fit.cost):
        rivals = [other for other in kept if other.look is fit.look]
        if len(rivals) < LOOK_MODES and not any(_near(fit, other, apart) for other in rivals):
            kept.append(fit)
        if len(kept) == n:
            break
    return kept


def _hopeful(fits: list[Fit]) -> list[Fit]:
    """The fits, the best first, without those that are far behind it."""
    return [fit for fit in fits if fit.cost < fits[0].cost + HOPELESS]


def _near(a: Fit, b: Fit, steps: float) -> bool:
    if a.lying is not b.lying:
        return False
    if not a.lying.order:
        return True
    period = a.lying.period
    apart = abs((a.pose[2] - b.pose[2] + period / 2) % period - period / 2)
    return apart < steps * _turn_step(a.look)


def improve(fit: Fit, seen: Seen, known: KnownPart, effort: Effort) -> Fit:
    """Draw poses around a fit, and move it to their mean weighted by likelihood, round by round.

    The cross-entropy method (Rubinstein, 1999); the poses of the last round are weighted as in importance
    sampling, so that their mean and covariance are those of the distribution of the pose given the image.
    """
    look, turns, surface = fit.look, bool(fit.lying.order), fit.lying.surface
    assert surface is not None
    cell, plane = effort.coarse * known.cell, look.top / 2
    pixels = Pixels.of(seen, plane, fit.pose[:2])
    seen_map = view(surface, fit.pose, seen.eye, plane=plane, cell=cell, reach=_DEPENDS_WITHIN * seen.pitch)
    # Between heights that are known well, a search that begins beside the truth must not end at a sharp edge.
    soft = seen.pitch if seen.smoothed else 0.0 if effort.exact or seen.noisy else cell
    flying = seen.pitch if seen.noisy and not seen.smoothed else 0.0
    table = HeightTable(seen_map, sigma=seen.sigma, soft=soft, flying=flying)
    chosen, weight = _informative(table, seen_map, pixels, fit.pose, seen, effort.pixels)
    some = pixels.take(chosen)
    normals = _normals()[: effort.draws]
    reach = np.array([effort.reach, effort.reach, turns * min(1.5 * effort.reach / look.radius, 0.1)])
    least = 0.02e-3 / np.array([1.0, 1.0, look.radius])
    root, mean, covariance = np.diag(reach), fit.pose, np.diag(reach**2)
    for number in range(effort.rounds):
        steps = normals @ root.T
        costs = weight * table.costs(some, mean + steps).sum(axis=1, dtype=float)
        if number == effort.rounds - 1:
            costs -= (normals**2).sum(axis=1) / 2
        weights = _weights(costs)
        shift = weights @ steps
        covariance = (weights[:, None] * (steps - shift)).T @ (steps - shift)
        mean = mean + shift
        values, vectors = np.linalg.eigh(covariance + np.diag(least**2))
        root = 1.5 * vectors * np.sqrt(values)
        root[2] *= turns
    moved = replace(fit, pose=mean, covariance=covariance)
    if effort.exact:
        return judge(moved, seen)
    return replace(moved, cost=float(table.costs(pixels, mean[None]).sum(dtype=float)) + _unlikely(fit))


def judge(fit: Fit, seen: Seen) -> Fit:
    """The fit with its exact costs."""
    assert fit.lying.surface is not None
    pixel_costs = ExactHeights(fit.lying.surface, fit.pose, seen).costs()
    return replace(fit, cost=float(pixel_costs.sum(dtype=float)) + _unlikely(fit), pixel_costs=pixel_costs)


def _unlikely(fit: Fit) -> float:
    """Negative logarithm of the probability of a resting pose."""
    return -float(np.log(max(fit.lying.probability, 0.01)))


def _informative(
    table: HeightTable, seen_map: HeightMap, pixels: Pixels, pose: np.ndarray, seen: Seen, most: int
) -> tuple[np.ndarray, int]:
    """Pixels near edges and slopes, whose height depends on the pose, and how many each stands for."""
    low, high = seen_map.bounds(_DEPENDS_WITHIN * seen.pitch)
    cells = table.cells(pixels, pose[None])[0]
    depends = np.flatnonzero((high - low).reshape(-1)[cells] > max(0.5e-3, 0.3 * seen.sigma))
    if not len(depends):
        depends = np.arange(len(cells))
    step = max(1, int(np.ceil(len(depends) / max(most, 1))))
    return depends[::step], step


def _weights(costs: np.ndarray) -> np.ndarray:
    """Weights by likelihood, at the least temperature at which a fifth of the draws count."""
    above, heat = costs - costs.min(), 1.0
    while True:
        weights = np.exp(-above / heat)
        weights /= weights.sum()
        if 1 / (weights**2).sum() >= 0.2 * len(costs):
            return weights
        heat *= 1.3


def _resting_poses(fit: Fit, seen: Seen) -> list[Fit]:
    """The resting poses of a look, the best first."""
    if len(fit.look.poses) == 1 or len(fit.look.poses) > MOST_COMPARED:
        return [fit]
    tries = [judge(_as(fit, lying, fit.pose), seen) for lying in fit.look.poses]
    return sorted(tries, key=lambda one: one.cost)


def _as(fit: Fit, lying: Lying, pose: np.ndarray) -> Fit:
    """A pose of a fit's resting pose, for another that looks alike."""
    return replace(fit, lying=lying, pose=pose + [0.0, 0.0, fit.lying.turn - lying.turn])
