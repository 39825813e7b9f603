"""Certified grasps of a known part: their outcome is measured by repeated simulation, not predicted.

A certified grasp belongs to a resting pose of the part and is given in the part's rest frame (`rest_frame`).
Of its displacement a mean is stored, the way in which it follows an error of the seen pose, and the
covariance of what remains, all in the axes of the grasp, with the closing direction along y.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadPart
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import (
    Pose,
    quat_about_z,
    quat_conjugate,
    quat_multiply,
    twist_and_swing,
    wrap_half_turn,
)
from mskgrasp.core.grasp import HAND_GEOMETRY
from mskgrasp.core.json_text import parse_json
from mskgrasp.core.metrics import wilson_interval
from mskgrasp.parts import Part, parts_folder

SCHEMA_VERSION = 4
FILE = "grasps.json"
SIMULATED_ALIKE = np.diag(np.square([5e-5, 5e-5, 5e-5, np.radians(0.1)]))
"""Covariance, metres and radians, to be added to that of a certified grasp: outcomes of the simulation itself
differ by so much if the part is moved by 10 um (docs/results/validation.md), where the repeats may not."""
_ROUNDING = 1e-9
"""Share of a covariance's greatest element that rounding may add."""
_LEAST_SPREAD = 1e-12
"""Smaller spreads are alike: (1 um)^2."""


@dataclass(frozen=True, kw_only=True)
class CertifiedGrasp:
    """A grasp with its measured outcome.

    But for mean and slope, to which all simulations contribute, it is that of the last simulations, by which
    the candidate was not chosen. They decide whether it is certified, and which grasp is planned;
    `without_selection_bias` makes up for the best of many seeming better than it is.

    Attributes:
        resting: Index of the part's resting pose.
        grasp: (4,) x y z theta in the rest frame of that pose, metres over the table and radians.
        n: Number of simulations.
        lifted: Number of those that lifted the part.
        mean: (4,) displacement of the part's origin in the hand from its seen pose, axes of the grasp,
            metres and radians.
        slope: (4, 3) change of the displacement with the true pose less the seen one: x and y along the axes
            of the grasp, metres, and turn, radians.
        residual: (4, 4) covariance of the displacement about that line.
        swing: (2,) mean swing of the part in the hand, radians about x and y of the grasp.
        swing_cov: (2, 2) its covariance.
        spread_error: Standard error of `spread`, as a share of it.
    """

    resting: int
    grasp: np.ndarray
    n: int
    lifted: int
    mean: np.ndarray
    slope: np.ndarray
    residual: np.ndarray
    swing: np.ndarray
    swing_cov: np.ndarray
    spread_error: float

    def covariance(self, pose_cov: np.ndarray) -> np.ndarray:
        """Covariance (4, 4) of the displacement, given that of the seen pose (3, 3), axes of the grasp."""
        return self.slope @ pose_cov @ self.slope.T + self.residual

    def score(self, pose_cov: np.ndarray, radius: float) -> float:
        """Expected squared distance, m^2, of the part's points from where they are predicted, a tilt counted.

        The variance score of `mskgrasp.planning.planner.variance_score`.

        Args:
            pose_cov: (3, 3) of the seen pose.
            radius: The part's radius of gyration about the vertical, metres.
        """
        spread = np.diag(self.covariance(pose_cov))
        turned = spread[3] + self.swing @ self.swing + np.trace(self.swing_cov)
        return float(spread[:3].sum() + radius**2 * turned)

    def spread(self, radius: float) -> float:
        """The part of `score` that simulations of a well-known pose and the mean swing leave open, m^2."""
        variance = np.diag(self.residual)
        return float(variance[:3].sum() + radius**2 * (variance[3] + np.trace(self.swing_cov)))

    @property
    def expected_share(self) -> float:
        """Expected share lifted: the mean of its posterior under a uniform prior."""
        return (self.lifted + 1) / (self.n + 2)

    @property
    def lifted_interval(self) -> tuple[float, float]:
        """95 % interval of the share lifted (Wilson)."""
        return wilson_interval(self.lifted, self.n)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: np.asarray(value).tolist() for name, value in values.items()}


_SHAPES = {
    "grasp": (4,), "mean": (4,), "slope": (4, 3), "residual": (4, 4), "swing": (2,), "swing_cov": (2, 2),
}  # fmt: skip


def without_selection_bias(grasps: Sequence[CertifiedGrasp], radius: float) -> list[CertifiedGrasp]:
    """The grasps with covariances of which the least is not flattered by being chosen as the least.

    Of several measured spreads the least is likely to be one that was measured too small. Each becomes its
    expectation given the others (empirical Bayes for log-normal spreads; Efron, Tweedie's formula and
    selection bias, JASA 2011): it moves towards their mean by the share of their differences that so few
    simulations explain.

    Args:
        grasps: All that are chosen from.
        radius: The part's radius of gyration about the vertical, metres.
    """
    noise = float(np.mean([one.spread_error**2 for one in grasps])) if grasps else 0.0
    if len(grasps) < 2 or not noise:
        return list(grasps)
    logs = np.log([max(one.spread(radius), _LEAST_SPREAD) for one in grasps])
    differences = max(0.0, float(logs.var(ddof=1)) - noise)
    weight = differences / (differences + noise)
    # The mean of the logarithms lies half the noise below that of the true spreads, and the expectation of a
    # log-normal quantity half its variance above its median.
    expected = logs.mean() + noise / 2 + weight * (logs - logs.mean()) + weight * noise / 2
    factors = np.exp(expected - logs)
    return [
        replace(one, residual=factor * one.residual, swing_cov=factor * one.swing_cov)
        for one, factor in zip(grasps, factors, strict=True)
    ]


@dataclass(frozen=True, kw_only=True)
class CertifiedGrasps:
    """Certified grasps of a part.

    Attributes:
        part: Name of the part.
        part_hash: Its content hash.
        grasps: The grasps, those of a resting pose in the order of their expected error.
        uncertified: The best simulated grasps of resting poses that have no certified one, least expected
            error first. The part tilts in them, always in the same way, or is not always lifted, or its
            displacement spreads too much (`mskgrasp.simulation.select_certified`).
        without: For resting poses without a certified grasp the reason, by index.
        like: For resting poses that look and behave as another one, its index and the turn (radians) by which
            their rest frame is turned against its, by index.
        stands: Of each resting pose, whether the simulation holds it.
        conditions: Settings that the grasps were certified under: physics, noise, errors of the seen pose,
            hand, versions, seed, number of simulations.
    """

    part: str
    part_hash: str
    grasps: tuple[CertifiedGrasp, ...]
    uncertified: tuple[CertifiedGrasp, ...]
    without: dict[int, str]
    like: dict[int, tuple[int, float]]
    stands: tuple[bool, ...]
    conditions: dict[str, Any]

    def of(self, resting: int) -> tuple[list[CertifiedGrasp], float]:
        """Grasps of a resting pose, and the turn of the rest frame they are given in against the pose's."""
        return self._of(self.grasps, resting)

    def uncertified_of(self, resting: int) -> tuple[list[CertifiedGrasp], float]:
        """The same of those that are not certified."""
        return self._of(self.uncertified, resting)

    def _of(self, grasps: Sequence[CertifiedGrasp], resting: int) -> tuple[list[CertifiedGrasp], float]:
        which, turn = self.like.get(resting, (resting, 0.0))
        return [grasp for grasp in grasps if grasp.resting == which], turn

    def write(self, folder: Path) -> None:
        """Write ``grasps.json`` into a folder, atomically.

        Raises:
            OSError: The disk is full or not writable.
        """
        write_whole(folder / FILE, self.contents())

    def contents(self) -> bytes:
        """Contents of ``grasps.json``."""
        values = dict(
            schema_version=SCHEMA_VERSION,
            part=self.part,
            part_hash=self.part_hash,
            hand=HAND_GEOMETRY,
            units="metres, radians; grasp: x y z theta in the rest frame of the resting pose",
            grasps=[grasp.to_json() for grasp in self.grasps],
            uncertified=[grasp.to_json() for grasp in self.uncertified],
            without={str(number): reason for number, reason in self.without.items()},
            like={str(number): list(other) for number, other in self.like.items()},
            stands=list(self.stands),
            conditions=self.conditions,
        )
        return (json.dumps(values, indent=1, allow_nan=False) + "\n").encode()


def certified_folder(part: Part) -> Path:
    """Folder of a part's certified grasps in the cache; it need not exist."""
    return parts_folder().with_name("certified") / part.content_hash[:32]


def read_certified(part: Part, folder: Path | None = None) -> CertifiedGrasps:
    """Read a part's certified grasps, from the cache unless another folder is given.

    Raises:
        BadPart: There are none, or the file is damaged, of another version, part or hand.
    """
    path = (folder or certified_folder(part)) / FILE
    remedy = f"make them: python -m mskgrasp.assess {part.name}"
    try:
        values = parse_json(path.read_bytes())
        if values["schema_version"] != SCHEMA_VERSION:
            versions = f"schema version {values['schema_version']}, legal: {SCHEMA_VERSION}"
            raise BadPart(f"{path} was written by another version of mskgrasp ({versions}); {remedy}")
        grasps, uncertified = (
            tuple(grasp_from_json(one, len(part.resting_probability)) for one in values[name])
            for name in ("grasps", "uncertified")
        )
        found = CertifiedGrasps(
            part=str(values["part"]),
            part_hash=str(values["part_hash"]),
            grasps=grasps,
            uncertified=uncertified,
            without={int(number): str(reason) for number, reason in values["without"].items()},
            like={int(number): (other, float(turn)) for number, (other, turn) in values["like"].items()},
            stands=tuple(values["stands"]),
            conditions=dict(values["conditions"]),
        )
        _check_values(found)
        n_resting = len(part.resting_probability)
        numbers = {*found.without, *found.like, *(other for other, _ in found.like.values())}
        if len(found.stands) != n_resting or not numbers <= set(range(n_resting)):
            raise ValueError(f"the part has {n_resting} resting poses")
        hand = values["hand"]
    except FileNotFoundError as error:
        raise BadPart(f"no certified grasps of '{part.name}'; {remedy}") from error
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise BadPart(f"{path} is damaged ({' '.join(str(error).split())}); {remedy}") from error
    if found.part_hash != part.content_hash:
        raise BadPart(f"{path} belongs to another version of '{part.name}'; {remedy}")
    if hand != HAND_GEOMETRY:
        raise BadPart(f"{path} was made for another hand; {remedy}")
    return found


def grasp_from_json(values: dict[str, Any], n_resting: int) -> CertifiedGrasp:
    """The grasp that `CertifiedGrasp.to_json` converted, of a part with so many resting poses.

    Raises:
        ValueError: A value is missing, not finite, or out of range.
    """
    arrays: dict[str, Any] = {name: np.array(values[name], dtype=np.float64) for name in _SHAPES}
    for name, array in arrays.items():
        if array.shape != _SHAPES[name] or not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite and of shape {_SHAPES[name]}")
    for name in ("residual", "swing_cov"):
        covariance = arrays[name]
        rounding = _ROUNDING * float(np.abs(covariance).max())
        symmetric = np.abs(covariance - covariance.T).max() <= rounding
        if not symmetric or np.linalg.eigvalsh(covariance)[0] < -rounding:
            raise ValueError(f"{name} is no covariance")
    counts: dict[str, Any] = {name: values[name] for name in ("resting", "n", "lifted")}
    spread_error = float(values["spread_error"])
    if not 0 <= spread_error < np.inf:
        raise ValueError("spread_error must be finite and not negative")
    if not all(type(count) is int for count in counts.values()):
        raise ValueError("resting, lifted and n must be integers")
    if not (0 <= counts["resting"] < n_resting and 0 <= counts["lifted"] <= counts["n"] > 0):
        raise ValueError("resting, lifted or n is out of range")
    return CertifiedGrasp(**arrays, **counts, spread_error=spread_error)


def _check_values(found: CertifiedGrasps) -> None:
    if not all(type(other) is int and np.isfinite(turn) for other, turn in found.like.values()):
        raise ValueError("like must hold indices and finite turns")
    if not all(isinstance(one, bool) for one in found.stands):
        raise ValueError("stands must be true or false")
    errors = found.conditions["pose_errors"]
    if not all(0 <= float(errors[name]) < np.inf for name in ("position", "turn")):
        raise ValueError("pose_errors must be finite and not negative")


def rest_frame(T_base_obj: Pose, quat_table_obj: np.ndarray) -> Pose:
    """Frame of a part at rest: under the part's origin at z = 0 of the base, z up, turned with the part.

    Args:
        T_base_obj: Pose of the part.
        quat_table_obj: (4,) wxyz, its orientation at turn 0 in the resting pose in which it lies.
    """
    turn, _ = twist_and_swing(quat_multiply(T_base_obj.quat_wxyz, quat_conjugate(quat_table_obj)))
    x, y, _ = T_base_obj.position
    return Pose(position=np.array([x, y, 0.0]), quat_wxyz=quat_about_z(np.asarray(turn)))


def turned(T_base_rest: Pose, turn: float) -> Pose:
    """A rest frame turned about its z by ``turn`` radians."""
    return T_base_rest @ Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.asarray(turn)))


def to_base(T_base_rest: Pose, grasps: np.ndarray, table_z: float = 0.0) -> np.ndarray:
    """Grasps (..., 4) of a part's rest frame in the base frame, over a table at ``table_z``, metres."""
    return _moved(T_base_rest, grasps, table_z)


def to_rest(T_base_rest: Pose, grasps: np.ndarray, table_z: float = 0.0) -> np.ndarray:
    """Grasps (..., 4) of the base frame in a part's rest frame; the inverse of `to_base`."""
    return _moved(T_base_rest.inverse(), grasps, -table_z)


def half_turned(T_base_rest: Pose, grasp: np.ndarray, in_base: np.ndarray) -> float:
    """-1 where the axes of a grasp (4,) of `to_base` are turned by half a turn against its own, else 1.

    A jaw is the same after half a turn, so that theta is wrapped; vectors along x and y change their signs.
    """
    turn, _ = twist_and_swing(T_base_rest.quat_wxyz)
    return 1.0 if np.cos(in_base[3] - turn - grasp[3]) > 0 else -1.0


def _moved(pose: Pose, grasps: np.ndarray, up: float) -> np.ndarray:
    turn, _ = twist_and_swing(pose.quat_wxyz)
    found = np.array(grasps, dtype=np.float64)
    found[..., :3] = pose.apply(found[..., :3])
    found[..., 2] += up
    found[..., 3] = wrap_half_turn(found[..., 3] + turn)
    return found


def radius_about_vertical(part: Part, resting: int) -> float:
    """Radius of gyration of a part about the vertical through its centroid in a resting pose, metres."""
    pose = Pose(position=np.zeros(3), quat_wxyz=part.resting.quat_wxyz[resting])
    up = pose.inverse().apply(np.array([0.0, 0.0, 1.0]))
    return float(np.sqrt(up @ part.inertia @ up / part.mass))
