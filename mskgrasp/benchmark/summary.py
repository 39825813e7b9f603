"""Summary of a benchmark: shares placed within tolerances, precision against refusals, error budget."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.core.share import Share
from mskgrasp.trials.placed_trial import Correction, PlacedTrial
from mskgrasp.trials.trial import REFUSED as PLANNER_REFUSED

DISTANCES = (2.5e-4, 5e-4, 1e-3, 2e-3, 5e-3)
"""Tolerances of the place, metres."""
ANGLES = tuple(float(angle) for angle in np.radians([1.0, 2.0, 5.0]))
"""Tolerances of the turn, radians."""
DISTANCE, ANGLE = DISTANCES[2], ANGLES[1]
"""The tolerance of the first table: 1 mm and 2 degrees."""
Column = Literal["none", "predicted", "camera", "truth"]
COLUMNS: tuple[Column, ...] = ("none", "predicted", "camera", "truth")
CAMERA_POSITION, CAMERA_TURN = 2e-4, float(np.radians(0.3))
"""Standard deviations (normal) of a camera that looks at the part in the hand: along x and y, m, and turn."""
REFUSED = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Shares of attempts, least predicted quality first, that the second table leaves out."""
STAGES = ("seeing", "seizing", "carrying", "releasing", "total")
_CORRECTION: dict[Column, Correction] = {
    "none": "none", "predicted": "predicted", "camera": "seen", "truth": "seen",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Row:
    """Trials of one planner.

    Attributes:
        planner: Its name.
        n_parts: Number of parts.
        lifted: Share lifted.
        within: By column, share within each of `DISTANCES` (first index) and `ANGLES` (second).
        reasons: Numbers of parts that were not placed, by reason.
        wrong_pose: Number of attempts at parts whose resting pose was found wrongly.
    """

    planner: str
    n_parts: int
    lifted: Share
    within: dict[Column, tuple[tuple[Share, ...], ...]]
    reasons: dict[str, int]
    wrong_pose: int

    def first(self, column: Column) -> Share:
        """Share within `DISTANCE` and `ANGLE`."""
        return self.within[column][DISTANCES.index(DISTANCE)][ANGLES.index(ANGLE)]

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        within = {
            column: [[share.to_json() for share in shares] for shares in grid]
            for column, grid in self.within.items()
        }
        return dict(
            planner=self.planner, n_parts=self.n_parts, lifted=self.lifted.to_json(), within=within,
            reasons=self.reasons, wrong_pose=self.wrong_pose,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """Precision of one planner with a bound on the predicted quality.

    Attributes:
        planner: Its name.
        bound: Least quality that is tried.
        refused: Share of attempts that are not tried.
        parts: Number of parts of which any attempt is tried.
        placed: Share of those tried within `DISTANCE` and `ANGLE`, corrected by the prediction.
    """

    planner: str
    bound: float
    refused: float
    parts: int
    placed: Share


@dataclass(frozen=True, kw_only=True)
class Budget:
    """Median errors of the placed attempts of one planner at one part, or at all.

    Attributes:
        planner: Its name.
        part: Name of the part; empty: all parts.
        n: Number of placed attempts.
        distance: By stage of `STAGES`, metres; None where no attempt tells it.
        turn: The same, radians.
    """

    planner: str
    part: str
    n: int
    distance: dict[str, float | None]
    turn: dict[str, float | None]


def placing_error(trial: PlacedTrial, column: Column, seed: int) -> tuple[float, float] | None:
    """Distance from the target, metres, and error of the turn, radians; None where the part was not placed.

    Args:
        trial: The trial.
        column: The correction.
        seed: Of the run; determines the errors of the camera that looks at the part in the hand, the same for
            all planners in a scene.
    """
    off = trial.off(_CORRECTION[column])
    if off is None:
        return None
    if column == "camera":
        rng = np.random.default_rng(trial_seeds(seed, trial.part, trial.number))
        off = off + rng.normal(size=3) * [CAMERA_POSITION, CAMERA_POSITION, CAMERA_TURN]
    return float(np.hypot(off[0], off[1])), float(abs(wrap_angle(off[2])))


def summarise(trials: Sequence[PlacedTrial], seed: int) -> list[Row]:
    """Summarise trials by planner, in the order in which they first occur."""
    return [_row(name, found, seed) for name, found in by_planner(trials).items()]


def by_planner(trials: Sequence[PlacedTrial]) -> dict[str, list[PlacedTrial]]:
    """Trials of each planner."""
    found: dict[str, list[PlacedTrial]] = {}
    for trial in trials:
        found.setdefault(trial.planner, []).append(trial)
    return found


def _row(planner: str, trials: Sequence[PlacedTrial], seed: int) -> Row:
    parts = [trial.part for trial in trials]
    within = {}
    for column in COLUMNS:
        errors = [placing_error(trial, column, seed) or (np.inf, np.inf) for trial in trials]
        off, turn = np.array(errors).T
        within[column] = tuple(
            tuple(Share.count((off <= distance) & (turn <= angle), parts) for angle in ANGLES)
            for distance in DISTANCES
        )
    return Row(
        planner=planner,
        n_parts=len(set(parts)),
        lifted=Share.count([trial.lifted for trial in trials], parts),
        within=within,
        reasons=dict(sorted(Counter(trial.reason for trial in trials if trial.reason).items())),
        wrong_pose=sum(trial.wrong_pose for trial in trials),
    )


def refusals(trials: Sequence[PlacedTrial], seed: int) -> list[Refusal]:
    """Precision of each planner that predicts qualities, by the share of attempts that it leaves out.

    An attempt without a quality, such as one in which no part was found, is left out first. Those in which
    the planner itself planned nothing are never among those tried.
    """
    found = []
    for planner, some in by_planner(trials).items():
        qualities = np.array([-1.0 if one.quality is None else one.quality for one in some])
        if (qualities < 0).all():
            continue
        errors = [placing_error(one, "predicted", seed) or (np.inf, np.inf) for one in some]
        off, turn = np.array(errors).T
        hits = (off <= DISTANCE) & (turn <= ANGLE)
        order = np.argsort(qualities, kind="stable")
        planned = np.array([one.reason != PLANNER_REFUSED and one.grasp is not None for one in some])
        for part_refused in REFUSED:
            least = float(qualities[order[int(part_refused * len(order))]])
            tried = planned & (qualities >= least)
            if not tried.any():
                continue
            names = [one.part for one, kept in zip(some, tried, strict=True) if kept]
            found.append(
                Refusal(
                    planner=planner, bound=max(0.0, float(qualities[tried].min())),
                    refused=float(1 - tried.mean()), parts=len(set(names)),
                    placed=Share.count(hits[tried], names),
                )
            )  # fmt: skip
    return list(dict.fromkeys(found))


def budgets(trials: Sequence[PlacedTrial]) -> list[Budget]:
    """Error budgets of every planner, over all parts first."""
    found = []
    for planner, some in by_planner(trials).items():
        found.append(_budget(planner, "", some))
        for part in dict.fromkeys(one.part for one in some):
            found.append(_budget(planner, part, [one for one in some if one.part == part]))
    return found


def stages(trial: PlacedTrial) -> dict[str, np.ndarray | None]:
    """x, y and turn (3,) of the error that each stage adds, axes of the grasp; None where unknown.

    Seeing: the found pose, or the seen centre, less the true one. Seizing: the displacement in the hand less
    the predicted one. Carrying: from the end of the lift to the moment before the release. Releasing: the
    rest of the total, the arm's error at the target included.
    """
    total = trial.off("predicted")
    found: dict[str, np.ndarray | None] = dict.fromkeys(STAGES)
    found["total"] = total
    found["seeing"] = None if trial.seeing is None else np.array(trial.seeing)
    if trial.measured is not None and trial.predicted is not None:
        found["seizing"] = np.subtract(trial.measured, trial.predicted)[[0, 1, 3]]
    if trial.carried and trial.held and trial.expected and total is not None:
        found["carrying"] = np.array(trial.carried)
        unpredicted = np.subtract(trial.held, trial.expected)[[0, 1, 3]]
        found["releasing"] = total - unpredicted - trial.carried
    return found


def _budget(planner: str, part: str, trials: Sequence[PlacedTrial]) -> Budget:
    placed = [stages(trial) for trial in trials if trial.off("predicted") is not None]
    distance: dict[str, float | None] = {}
    turn: dict[str, float | None] = {}
    for stage in STAGES:
        known = np.array([one[stage] for one in placed if one[stage] is not None]).reshape(-1, 3)
        distance[stage] = float(np.median(np.hypot(known[:, 0], known[:, 1]))) if len(known) else None
        turn[stage] = float(np.median(np.abs(wrap_angle(known[:, 2])))) if len(known) else None
    return Budget(planner=planner, part=part, n=len(placed), distance=distance, turn=turn)


def stored_row(values: Mapping[str, Any]) -> Row:
    """The row that `Row.to_json` converted."""
    within: dict[Column, tuple[tuple[Share, ...], ...]] = {
        column: tuple(tuple(map(Share.from_json, shares)) for shares in values["within"][column])
        for column in COLUMNS
    }
    return Row(**dict(values, lifted=Share.from_json(values["lifted"]), within=within))


def summary_json(
    rows: Sequence[Row], refused: Sequence[Refusal], budget: Sequence[Budget], **known: Any
) -> dict[str, Any]:
    """Contents of ``report.json``; ``known`` describes the run."""
    return dict(
        schema_version=1,
        **known,
        distances=list(DISTANCES),
        angles=list(ANGLES),
        camera=dict(position_std=CAMERA_POSITION, turn_std=CAMERA_TURN),
        rows=[row.to_json() for row in rows],
        refusals=[asdict(one) | dict(placed=one.placed.to_json()) for one in refused],
        budgets=[asdict(one) for one in budget],
    )
