"""Certification of grasps: candidates of the networks, simulated again and again by successive halving.

A resting pose gets streams of simulations, each of which halves candidates of its own, so that streams can be
made in any order and by any worker. A stream draws candidates that the networks like, simulates each twice,
adds to the best the grasps in which the part would not have moved, simulates all four times more, and
simulates the best of them afresh: only these last simulations are stored as a grasp's outcome.
"""

from __future__ import annotations

import zlib
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from pydantic import Field

from mskgrasp.core.config import Config
from mskgrasp.core.errors import NoPartFound
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import (
    TABLE_CLEARANCE,
    TILT_LIMIT,
    centre_in_grasp_frame,
    lowest_grasp_z,
    pose_base_grasp,
    to_grasp_displacement,
    to_object_displacement,
)
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionNoise, Physics
from mskgrasp.planning.certified import (
    CertifiedGrasp,
    half_turned,
    radius_about_vertical,
    rest_frame,
    to_rest,
    turned,
)
from mskgrasp.planning.planner import Planner, shortlist, variance_score
from mskgrasp.planning.scoring import Scene, displacements, qualities
from mskgrasp.simulation.pad_contact import HeldPart, moment_share
from mskgrasp.simulation.repeats import PoseErrors, Repeat, captured_frame, place_part, repeat_grasp
from tasks import GraspDisplacementEnv

CERTIFY_VERSION = 5
"""Raised by every change after which a seed simulates other grasps."""
FIRST, SECOND = 2, 4
"""Simulations of each candidate in the first round and of each of the best in the second."""
FAILED = 0.01
"""Distance that counts for a simulation that did not lift the part, m."""
APART = (0.006, np.radians(12.0))
"""Candidates nearer to a better one than this, m and radians, are left out."""


class CertifyConfig(Config):
    """Settings of the certification of grasps."""

    simulations: int = Field(default=1200, ge=24)
    """Simulated grasps of a part, shared by its resting poses."""
    per_stream: int = Field(default=200, ge=20)
    """Greatest number of simulations of one stream, of which three or so grasps come."""
    kept: int = Field(default=8, ge=1)
    """Greatest number of certified grasps of a resting pose."""
    least_probability: float = Field(default=0.02, ge=0, le=1)
    """Resting poses that are rarer are left to the networks, but for the likeliest."""
    least_lifted: float = Field(default=0.95, ge=0, le=1)
    """Least share of its last simulations that a certified grasp lifts."""
    most_error: float = Field(default=0.002, gt=0)
    """Greatest expected distance (RMS) by which a certified grasp's part misses its predicted place, m."""
    clearance: float = Field(default=TABLE_CLEARANCE, ge=TABLE_CLEARANCE, le=0.06)
    """Least distance of the pads from the table, m."""
    pose_errors: PoseErrors = PoseErrors()
    """Errors of the part's pose as the camera gives it."""
    noise: ExecutionNoise = ExecutionNoise(
        arm_position_std=1e-4, friction_pad_part=(0.3, 0.8), finger_force=(30.0, 70.0)
    )
    """Errors of the arm, and what a cell does not know."""
    physics: Physics = Physics()
    seed: int = Field(default=0, ge=0, lt=2**63)

    @property
    def least_friction_force(self) -> float:
        """Greatest friction of a pad, N, that all but 1 - ``least_lifted`` of the simulations exceed."""
        friction, force = (
            np.linspace(*(varied or (fixed, fixed)), 101)
            for varied, fixed in (
                (self.noise.friction_pad_part, self.physics.friction_pad_part),
                (self.noise.finger_force, self.physics.finger_force),
            )
        )
        return float(np.quantile(np.outer(friction, force), 1 - self.least_lifted))


@dataclass(frozen=True, kw_only=True)
class Member:
    """A resting pose of a group of alike ones.

    Attributes:
        which: Index among the poses that stand in the engine.
        turn: Turn of the group's first pose that carries it into this one, radians.
        probability: Of the pose, within the part.
    """

    which: int
    turn: float
    probability: float


@dataclass(frozen=True, kw_only=True)
class Stream:
    """A stream of simulations of one group of resting poses.

    Attributes:
        part: Name or folder of the part.
        resting: Index of the group's first resting pose.
        members: The group.
        number: Number of the stream among those of the group.
        simulations: Number of its simulations.
    """

    part: str
    resting: int
    members: tuple[Member, ...]
    number: int
    simulations: int

    @property
    def key(self) -> str:
        """Identifier of the stream within the part."""
        return f"{self.resting:03d}-{self.number:02d}"


@dataclass(eq=False)
class _Candidate:
    grasp: np.ndarray
    repeats: list[Repeat]

    def score(self, radius: float) -> float:
        """Squared distance, m^2, of the part's points from the mean of their places, a tilt counted."""
        lifted = [one for one in self.repeats if not one.reason]
        failed = (len(self.repeats) - len(lifted)) / len(self.repeats) * FAILED**2
        if len(lifted) < 2:
            return failed + FAILED**2
        spread = np.stack([one.displacement for one in lifted]).var(axis=0, ddof=1)
        swung = float(np.mean([one.swing @ one.swing for one in lifted]))
        return float(failed + spread[:3].sum() + radius**2 * (spread[3] + swung))


_Ranked = TypeVar("_Ranked", _Candidate, CertifiedGrasp)


def run_stream(
    env: GraspDisplacementEnv, planner: Planner, stream: Stream, config: CertifyConfig
) -> Generator[None, None, list[CertifiedGrasp]]:
    """Certify grasps of one stream; yield after each simulation.

    Args:
        env: Holds the part; its physics and noise are those of the settings.
        planner: Of the networks whose candidates are simulated.
        stream: The stream.
        config: The settings.

    Returns:
        The grasps of the last round, whatever their outcome.
    """
    part = env.parts[0]
    name = zlib.crc32(part.name.encode())
    radius = radius_about_vertical(part, stream.resting)
    shares = np.array([member.probability for member in stream.members])
    shares /= shares.sum()
    rng = np.random.default_rng([config.seed, name, stream.resting, stream.number])

    def simulate(candidate: _Candidate, first: int, n: int) -> Generator[None, None, None]:
        for number in range(first, first + n):
            # The same scenes for all candidates of the stream: their differences are those of the grasps.
            seed = (config.seed, name, stream.resting, stream.number, number)
            member = stream.members[np.random.default_rng(seed[::-1]).choice(len(shares), p=shares)]
            candidate.repeats.append(
                repeat_grasp(env, member.which, candidate.grasp, config.pose_errors, seed, offset=member.turn)
            )
            yield

    n_first, n_second, n_last, last = round_sizes(stream.simulations)
    found = [
        _Candidate(grasp, [])
        for grasp in candidate_grasps(env, planner, stream, rng, n_first, config.least_friction_force)
    ]
    for candidate in found:
        yield from simulate(candidate, 0, FIRST)
    best = sorted(found, key=lambda one: one.score(radius))[: n_second // 2]
    height = float(env.standing[0].poses.position[stream.members[0].which, 2])
    lowest = lowest_grasp_z(0.0, config.clearance)
    best = [_Candidate(one.grasp, []) for one in best] + [
        _Candidate(grasp, []) for one in best if (grasp := _without_motion(one, height, lowest)) is not None
    ]
    for candidate in best:
        yield from simulate(candidate, FIRST, SECOND)
    ranked = sorted(best, key=lambda one: one.score(radius))
    grasps = []
    for candidate in spread_out(ranked, n_last):
        before, candidate.repeats = candidate.repeats, []
        yield from simulate(candidate, FIRST + SECOND, last)
        grasps.append(measured(stream.resting, radius, candidate.grasp, candidate.repeats, before))
    return grasps


def round_sizes(simulations: int) -> tuple[int, int, int, int]:
    """Candidates of the first, second and last round of a stream, and simulations of each in the last."""
    last = 24 if simulations >= 120 else 10
    n_last = max(1, round(0.36 * simulations / last))
    n_second = max(2, 2 * round(0.32 * simulations / SECOND / 2))
    n_first = max(2, (simulations - n_last * last - n_second * SECOND) // FIRST)
    return n_first, n_second, n_last, last


def candidate_grasps(
    env: GraspDisplacementEnv,
    planner: Planner,
    stream: Stream,
    rng: np.random.Generator,
    n: int,
    friction_force: float,
) -> list[np.ndarray]:
    """Candidates (4,) in the rest frame that the networks like, from images of the part at three turns.

    Those whose pads would not hold the part's weight, as it is predicted to lie in the hand, are taken only
    where too few others are left. ``friction_force`` is the greatest friction of a pad, N.
    """
    x_min, x_max, y_min, y_max = REGION
    middle = np.array([x_min + x_max, y_min + y_max]) / 2
    member = stream.members[0]
    quat_table_obj = env.parts[0].resting.quat_wxyz[stream.resting]
    grasps: list[np.ndarray] = []
    scores: list[np.ndarray] = []
    held: list[HeldPart] = []
    for turn in rng.uniform(-np.pi, np.pi, size=3):
        pose = place_part(env, member.which, middle, float(turn))
        frame = captured_frame(env)
        try:
            view, drawn = planner.sample(frame, rng)
        except NoPartFound:  # too flat for the camera
            continue
        candidates = drawn.as_vector()
        scene = Scene.of(frame, view, TABLE_Z, planner.models.device)
        quality = qualities(planner.models, scene, candidates, planner.config.chunk_size)
        best = candidates[shortlist(quality, planner.config.top_fraction)]
        mean, variance = displacements(planner.models, scene, best, planner.config.chunk_size)
        T_base_rest = turned(rest_frame(pose, quat_table_obj), member.turn)
        grasps.append(to_rest(T_base_rest, best, TABLE_Z))
        scores.append(variance_score(mean, variance, best, view))
        origin = centre_in_grasp_frame(np.asarray(pose.position), best)
        motion = np.column_stack([to_object_displacement(mean, origin), mean[:, 4:]])
        for grasp, in_base, moved in zip(grasps[-1], best, motion, strict=True):
            sign = half_turned(T_base_rest, grasp, in_base)
            moved[[0, 1, *range(4, len(moved))]] *= sign
            swing = moved[4:] if len(moved) > 4 else np.zeros(2)
            held.append(
                HeldPart(
                    part=env.parts[0],
                    resting=stream.resting,
                    grasp=grasp,
                    displacement=moved[:4],
                    swing=swing,
                )
            )
    if not grasps:
        return []
    order = np.argsort(np.concatenate(scores), kind="stable")
    return _first_held([held[row] for row in order], n, friction_force)


def _first_held(parts: Sequence[HeldPart], n: int, friction_force: float) -> list[np.ndarray]:
    """The first n grasps of parts whose weight the pads hold, apart from those before them.

    Filled up with others that hold, then with those that do not. What pads touch takes time to find, and is
    found no further than needed.
    """
    apart: list[np.ndarray] = []
    near: list[np.ndarray] = []
    lost: list[np.ndarray] = []
    for held in parts:
        if moment_share(held, friction_force) <= 1:
            new = all(_apart(held.grasp, other) for other in apart)
            (apart if new else near).append(held.grasp)
        else:
            lost.append(held.grasp)
        if len(apart) == n:
            return apart
    chosen = (apart + near)[:n]
    return chosen + _distinct(lost, n - len(chosen))


def _distinct(grasps: Sequence[np.ndarray], n: int) -> list[np.ndarray]:
    """The first n grasps that are apart from those before them, filled up with the others in their order."""
    chosen: list[int] = []
    for row in range(len(grasps)):
        if len(chosen) < n and all(_apart(grasps[row], grasps[other]) for other in chosen):
            chosen.append(row)
    rest = [row for row in range(len(grasps)) if row not in set(chosen)]
    return [grasps[row] for row in (chosen + rest)[:n]]


def spread_out(ranked: Sequence[_Ranked], n: int) -> list[_Ranked]:
    """The first n grasps that are apart from each other, filled up with others, in the order given."""
    if not ranked:
        return []
    chosen = {grasp.tobytes() for grasp in _distinct([one.grasp for one in ranked], n)}
    return [one for one in ranked if one.grasp.tobytes() in chosen][:n]


def _apart(first: np.ndarray, second: np.ndarray) -> bool:
    far = float(np.linalg.norm(first[:3] - second[:3])) > APART[0]
    return far or abs(float(wrap_half_turn(np.asarray(first[3] - second[3])))) > APART[1]


def _without_motion(candidate: _Candidate, height: float, lowest: float) -> np.ndarray | None:
    """The grasp in which the part would not have moved, since it is already where it came to lie in the hand.

    Args:
        candidate: With its outcomes.
        height: Of the part's origin over the table, metres.
        lowest: Least height of a grasp over the table, metres.
    """
    moved = [one.displacement for one in candidate.repeats if not one.reason]
    tilts = [np.linalg.norm(one.swing) for one in candidate.repeats if not one.reason]
    if not moved or max(tilts) > 2 * TILT_LIMIT:
        return None
    origin = centre_in_grasp_frame(np.array([0.0, 0.0, height]), candidate.grasp)
    motion = to_grasp_displacement(np.mean(moved, axis=0), origin)
    grasp = candidate.grasp.copy()
    grasp[:2] = pose_base_grasp(candidate.grasp).apply(motion[:3])[:2]
    grasp[2] = max(grasp[2], lowest)
    grasp[3] = wrap_half_turn(np.asarray(grasp[3] + motion[3]))
    return grasp


def measured(
    resting: int, radius: float, grasp: np.ndarray, last: Sequence[Repeat], before: Sequence[Repeat] = ()
) -> CertifiedGrasp:
    """Describe a grasp by its outcomes.

    The line by which the displacement follows the error of the seen pose is fitted to all outcomes; how often
    the part is lifted, and how far outcomes lie from the line, is that of the last ones alone, by which the
    grasp was not chosen among the candidates.

    Args:
        resting: Index of the resting pose.
        radius: The part's radius of gyration about the vertical in that pose, metres.
        grasp: (4,) in its rest frame.
        last: Outcomes of the last round.
        before: Those of the rounds before.
    """
    held = [one for one in last if not one.reason]
    known = held + [one for one in before if not one.reason]
    slope, mean, residual = np.zeros((4, 3)), np.zeros(4), np.zeros((4, 4))
    swing, swing_cov, spread_error = np.zeros(2), np.zeros((2, 2)), 0.0
    if len(known) >= 6 and len(held) >= 3:
        inputs = np.column_stack([np.ones(len(known)), [one.error[[0, 1, 3]] for one in known]])
        moved = np.stack([one.displacement for one in known])
        line, *_ = np.linalg.lstsq(inputs, moved, rcond=None)
        mean, slope = line[0], line[1:].T
        off = (moved - inputs @ line)[: len(held)]
        # Of the line's four numbers the last outcomes bear their share; a new outcome misses the line by its
        # own spread and by the error of the line.
        unbiased = off.T @ off / max(1.0, len(held) * (1 - 4 / len(known)))
        residual = (1 + 4 / len(known)) * unbiased
        swings = np.stack([one.swing for one in held])
        swing, swing_cov = swings.mean(axis=0), np.cov(swings.T)
        angles = np.column_stack([off[:, 3], swings - swing])
        missed = np.square(off[:, :3]).sum(axis=1) + radius**2 * np.square(angles).sum(axis=1)
        spread_error = float(missed.std(ddof=1) / np.sqrt(len(held)) / max(missed.mean(), 1e-12))
    return CertifiedGrasp(
        resting=resting,
        grasp=grasp,
        n=len(last),
        lifted=len(held),
        mean=mean,
        slope=slope,
        residual=residual,
        swing=swing,
        swing_cov=swing_cov,
        spread_error=spread_error,
    )
