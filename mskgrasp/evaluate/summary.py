"""Summary of trials in numbers: success rates and errors of predicted displacements."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.core.metrics import rms_interval
from mskgrasp.core.predicted_intervals import coverage
from mskgrasp.core.share import Share
from mskgrasp.trials.lowess import TURN_LENGTH
from mskgrasp.trials.trial import Prediction, Trial

SCHEMA_VERSION = 2
COVERED = 0.9
"""The central interval whose coverage is reported."""

TILTED = float(np.radians(1.0))
"""A part tilted in the hand by more than this comes to rest in another pose than it was held in, radians."""

PAPER_SUCCESS = {"simulated": 0.949, "real": 0.863}
"""Success rates on novel parts (Zhao et al. 2019, evaluation in simulation and on the robot)."""

WITHIN = (1e-3, 2e-3)
"""Errors of the predicted displacement up to which shares of all attempts are reported, metres."""

MOST_WORST = 10
"""Trials that are shown as the worst."""

Interval = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class TrialStatistics:
    """Success and displacement errors of some trials; metres, radians, intervals of 95 %.

    A quantity that no trial measured is None, not zero.

    Attributes:
        success_interval: Interval of the success rate over parts, whose trials are alike (`share_interval`).
        reasons: Numbers of failures by reason.
        unmeasured: Numbers of unmeasured successes by reason.
        measured: Number of trials with a measured and a predicted displacement, which the errors are of.
        translation_interval: Interval of the RMSE over parts (`rms_interval`); None where it is unbounded.
        rotation_interval: The same of the turn.
        translation_rmse_of_zero: RMSE of predicting no displacement for the same grasps.
        rotation_rmse_of_zero: The same of the turn.
        coverage_90: Share of the measurements within the predicted central 90 %, by component; None where a
            variance or a component is unknown.
        within: Shares of all trials in which the part was lifted and its predicted displacement is off by at
            most each of `WITHIN`; None where none is measured.
        tilted: Share of the lifted parts tilted by more than `TILT_LIMIT`; None where no tilt is known.
        flat: Number of measured trials without those.
        flat_translation_rmse: RMSE over them.
        flat_translation_interval: Its interval, as above.
        flat_rotation_rmse: The same of the turn.
        flat_rotation_interval: The same of the turn.
        certified: Of the planned grasps of policy ``certified`` those that are certified, and their number;
            None for other policies, and where it was not recorded.
        uncertified: Of these, simulated ones that are not certified; the others are the networks'.
    """

    trials: int
    successes: int
    success_rate: float | None
    success_interval: Interval | None
    reasons: dict[str, int]
    unmeasured: dict[str, int]
    median_planning_s: float | None
    measured: int
    measured_parts: int
    translation_rmse: float | None
    translation_interval: Interval | None
    rotation_rmse: float | None
    rotation_interval: Interval | None
    translation_rmse_of_zero: float | None
    rotation_rmse_of_zero: float | None
    tilt_rms: float | None
    coverage_90: list[float] | None
    within: list[Share] | None = None
    tilted: Share | None = None
    flat: int = 0
    flat_translation_rmse: float | None = None
    flat_translation_interval: Interval | None = None
    flat_rotation_rmse: float | None = None
    flat_rotation_interval: Interval | None = None
    certified: tuple[int, int] | None = None
    uncertified: int = 0

    @classmethod
    def of(
        cls, trials: Sequence[Trial], prediction: Callable[[Trial], Prediction | None] | None = None
    ) -> TrialStatistics:
        """Compute the statistics of trials.

        Args:
            trials: In any order.
            prediction: The prediction that is compared with the measurement, by default `own_prediction`; a
                trial without one has no error.
        """
        lifted = Share.count([trial.success for trial in trials], [trial.part for trial in trials])
        planning = [trial.planning_s for trial in trials if trial.planning_s is not None]
        tilts = np.array([trial.tilt for trial in trials if trial.tilt is not None])
        compared, measured, predicted, std = _measurements(trials, prediction or own_prediction)
        parts = np.array([trial.part for trial in compared])
        errors = displacement_errors(predicted, measured)
        planned_by = [trial.planned_by for trial in trials if trial.policy == "certified" and trial.grasp]
        flat = np.array([(np.inf if t.tilt is None else t.tilt) <= TILT_LIMIT for t in compared], dtype=bool)
        errors_of_zero = displacement_errors(0 * predicted, measured)
        known = len(parts) > 0 and np.isfinite(std).all() and np.isfinite(measured).all()
        return cls(
            trials=len(trials),
            successes=lifted.n,
            success_rate=lifted.value if trials else None,
            success_interval=lifted.interval if trials else None,
            reasons=_counts(trial.reason for trial in trials if trial.reason),
            unmeasured=_counts(trial.unmeasured.split(":")[0] for trial in trials if trial.unmeasured),
            median_planning_s=float(np.median(planning)) if planning else None,
            measured=len(parts),
            measured_parts=len(set(parts.tolist())),
            translation_rmse=_rms(errors[0]),
            translation_interval=_interval(errors[0], parts),
            rotation_rmse=_rms(errors[1]),
            rotation_interval=_interval(errors[1], parts),
            translation_rmse_of_zero=_rms(errors_of_zero[0]),
            rotation_rmse_of_zero=_rms(errors_of_zero[1]),
            tilt_rms=_rms(tilts),
            coverage_90=coverage(predicted, std**2, measured, COVERED).tolist() if known else None,
            within=_within(trials, compared, errors[0]),
            tilted=_tilted([trial for trial in trials if trial.tilt is not None and trial.success]),
            flat=int(flat.sum()),
            flat_translation_rmse=_rms(errors[0][flat]),
            flat_translation_interval=_interval(errors[0][flat], parts[flat]),
            flat_rotation_rmse=_rms(errors[1][flat]),
            flat_rotation_interval=_interval(errors[1][flat], parts[flat]),
            certified=(planned_by.count("certified"), len(planned_by)) if planned_by else None,
            uncertified=planned_by.count("uncertified"),
        )


@dataclass(frozen=True, kw_only=True)
class TapeErrors:
    """Errors of measuring by tape, in the plane; metres, radians, None without a trial."""

    trials: int
    translation_rmse: float | None = None
    translation_worst: float | None = None
    rotation_rmse: float | None = None
    rotation_worst: float | None = None


@dataclass(frozen=True, kw_only=True)
class TapeComparison:
    """Errors of measuring by tape, for parts held flat and for those tilted by more than ``tilt``, radians.

    A tilted part comes to rest flat when it is put down, which moves it once more; tape includes that motion.
    """

    flat: TapeErrors
    tilted: TapeErrors
    tilt: float = TILTED


@dataclass(frozen=True, kw_only=True)
class SuccessSummary:
    """Success of all trials, of each family and of each part, beside the paper's success rates."""

    experiment: Literal["success"] = "success"
    schema_version: int = SCHEMA_VERSION
    overall: TrialStatistics
    families: dict[str, TrialStatistics]
    parts: dict[str, TrialStatistics]
    tape_against_truth: TapeComparison | None
    paper: dict[str, float]


def summarise_trials(trials: Sequence[Trial]) -> SuccessSummary:
    """Summarise the trials of a success experiment."""
    return SuccessSummary(
        overall=TrialStatistics.of(trials),
        families=_grouped(trials, lambda trial: trial.family),
        parts=_grouped(trials, lambda trial: trial.part),
        tape_against_truth=compare_tape(trials),
        paper=PAPER_SUCCESS,
    )


def _grouped(trials: Sequence[Trial], name: Callable[[Trial], str]) -> dict[str, TrialStatistics]:
    groups: dict[str, list[Trial]] = {}
    for trial in trials:
        groups.setdefault(name(trial), []).append(trial)
    return {group: TrialStatistics.of(groups[group]) for group in sorted(groups)}


def own_prediction(trial: Trial) -> Prediction | None:
    """The prediction of the model that planned the trial."""
    if trial.predicted is None or trial.predicted_std is None:
        return None
    return Prediction(mean=trial.predicted, std=trial.predicted_std)


def _counts(words: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(words).items()))


def _measurements(
    trials: Sequence[Trial], prediction: Callable[[Trial], Prediction | None]
) -> tuple[list[Trial], np.ndarray, np.ndarray, np.ndarray]:
    """Measured trials (n), their displacements, predicted means and standard deviations (n, 4)."""
    pairs = [(trial, prediction(trial)) for trial in trials if trial.measured is not None]
    rows = [(t, t.measured, one.mean, one.std) for t, one in pairs if one is not None]
    compared, *vectors = zip(*rows, strict=True) if rows else ((), (), (), ())
    measured, mean, std = (np.array(values, dtype=np.float64).reshape(-1, 4) for values in vectors)
    return list(compared), measured, mean, std


def displacement_errors(predicted: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute distances (n,), metres, and absolute angles (n,), radians, between displacements (n, 4).

    Where dz was not measured (NaN) the distance is that in the plane.
    """
    off = np.asarray(predicted, dtype=np.float64) - np.asarray(measured, dtype=np.float64)
    off[:, 2] = np.where(np.isnan(off[:, 2]), 0.0, off[:, 2])
    return np.linalg.norm(off[:, :3], axis=1), np.abs(wrap_angle(off[:, 3]))


def rms(errors: np.ndarray) -> float:
    """Compute the root of the mean square."""
    return float(np.sqrt((errors**2).mean()))


def _rms(errors: np.ndarray) -> float | None:
    return rms(errors) if len(errors) else None


def _interval(errors: np.ndarray, parts: np.ndarray) -> Interval | None:
    return rms_interval([errors[parts == part] for part in np.unique(parts)])


def _within(trials: Sequence[Trial], compared: Sequence[Trial], distances: np.ndarray) -> list[Share] | None:
    """Shares of all trials within each of `WITHIN`, of those compared with their errors (n,), metres.

    A part that was lifted and not measured may be anywhere, and is left out.
    """
    if not compared:
        return None
    off = dict(zip((trial.key for trial in compared), distances.tolist(), strict=True))
    known = [trial for trial in trials if trial.key in off or not trial.success]
    parts = [trial.part for trial in known]
    return [Share.count([off.get(trial.key, np.inf) <= most for trial in known], parts) for most in WITHIN]


def _tilted(lifted: Sequence[Trial]) -> Share | None:
    if not lifted:
        return None
    return Share.count(
        [(trial.tilt or 0.0) > TILT_LIMIT for trial in lifted], [trial.part for trial in lifted]
    )


def compare_tape(trials: Sequence[Trial]) -> TapeComparison | None:
    """Compare displacements measured by tape with those of a tracker; None where not both are known."""
    both = [t for t in trials if t.measured is not None and t.true is not None]
    if not both:
        return None
    return TapeComparison(
        flat=_tape_errors([t for t in both if (t.tilt or 0.0) <= TILTED]),
        tilted=_tape_errors([t for t in both if (t.tilt or 0.0) > TILTED]),
    )


def _tape_errors(trials: Sequence[Trial]) -> TapeErrors:
    if not trials:
        return TapeErrors(trials=0)
    distance, angle = displacement_errors(
        np.array([t.true for t in trials]), np.array([t.measured for t in trials])
    )
    return TapeErrors(
        trials=len(trials),
        translation_rmse=_rms(distance),
        translation_worst=float(distance.max()),
        rotation_rmse=_rms(angle),
        rotation_worst=float(angle.max()),
    )


def worst_trials(trials: Sequence[Trial]) -> list[Trial]:
    """Select failures by decreasing predicted quality, then trials by decreasing prediction error."""
    failed = sorted((t for t in trials if not t.success), key=lambda t: (-(t.quality or 0.0), t.key))
    return [*failed, *largest_errors(trials)][:MOST_WORST]


def largest_errors(trials: Sequence[Trial], n: int = MOST_WORST) -> list[Trial]:
    """Select the measured trials with the largest prediction errors, the largest first."""
    measured = (trial for trial in trials if _error(trial) is not None)
    return sorted(measured, key=lambda trial: (-(_error(trial) or 0.0), trial.key))[:n]


def _error(trial: Trial) -> float | None:
    """Error of the own prediction, metres, a radian counted as `TURN_LENGTH`; None where not measured."""
    if trial.measured is None or trial.predicted is None:
        return None
    distance, angle = displacement_errors(np.array([trial.predicted]), np.array([trial.measured]))
    return float(np.hypot(distance[0], TURN_LENGTH * angle[0]))
