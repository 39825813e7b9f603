"""Summary of trials in numbers: success rates and errors of predicted displacements."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.metrics import bootstrap_interval, coverage, wilson_interval
from mskgrasp.trials.lowess import TURN_LENGTH
from mskgrasp.trials.trial import Prediction, Trial

SCHEMA_VERSION = 2
COVERED = 0.9
"""The central interval whose coverage is reported."""

TILTED = float(np.radians(1.0))
"""A part that hangs tilted by more than this is put down otherwise than it was held, radians."""

PAPER_SUCCESS = {"simulated": 0.949, "real": 0.863}
"""Share of novel parts' grasps that lifted (Zhao et al. 2019, evaluation in simulation and on the robot)."""


def own_prediction(trial: Trial) -> Prediction | None:
    """What the model that planned the trial expected."""
    if trial.predicted is None or trial.predicted_std is None:
        return None
    return Prediction(mean=trial.predicted, std=trial.predicted_std)


def summarise(trials: Sequence[Trial]) -> dict[str, Any]:
    """Success and displacement errors, of all trials, of each family and of each part.

    Without a single measured success the errors are absent (None), not zero.
    """
    return dict(
        schema_version=SCHEMA_VERSION,
        overall=numbers(trials),
        families=_each(trials, lambda trial: trial.family),
        parts=_each(trials, lambda trial: trial.part),
        tape_against_truth=tape_against_truth(trials),
        paper=PAPER_SUCCESS,
    )


def _each(trials: Sequence[Trial], of: Callable[[Trial], str]) -> dict[str, Any]:
    groups: dict[str, list[Trial]] = {}
    for trial in trials:
        groups.setdefault(of(trial), []).append(trial)
    return {name: numbers(groups[name]) for name in sorted(groups)}


def numbers(
    trials: Sequence[Trial], prediction: Callable[[Trial], Prediction | None] = own_prediction
) -> dict[str, Any]:
    """Of some trials; metres and radians, intervals of 95 %.

    Args:
        trials: In any order.
        prediction: Which of the predictions counts; a trial without it is not among the errors.
    """
    n_success = sum(trial.success for trial in trials)
    planning = [trial.planning_s for trial in trials if trial.planning_s is not None]
    return dict(
        trials=len(trials),
        successes=n_success,
        success_rate=n_success / len(trials) if trials else None,
        success_interval=list(wilson_interval(n_success, len(trials))) if trials else None,
        reasons=_counted(trial.reason for trial in trials if trial.reason),
        unmeasured=_counted(trial.unmeasured.split(":")[0] for trial in trials if trial.unmeasured),
        median_planning_s=float(np.median(planning)) if planning else None,
        **_errors(trials, prediction),
    )


def _counted(words: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(words).items()))


def _errors(trials: Sequence[Trial], prediction: Callable[[Trial], Prediction | None]) -> dict[str, Any]:
    rows = [(t.part, t.measured, prediction(t)) for t in trials if t.measured is not None]
    rows = [(part, measured, one) for part, measured, one in rows if one is not None]
    parts = np.array([part for part, _, _ in rows])
    true = np.array([measured for _, measured, _ in rows]).reshape(-1, 4)
    expected = np.array([one.mean for _, _, one in rows]).reshape(-1, 4)
    found: dict[str, Any] = dict(measured=len(rows), measured_parts=len(set(parts.tolist())))
    for suffix, predicted in (("", expected), ("_of_zero", 0 * expected)):
        for kind, errors in zip(
            ("translation", "rotation"), displacement_errors(predicted, true), strict=True
        ):
            found[f"{kind}_rmse{suffix}"] = _rms(errors) if rows else None
            if not suffix:
                found[f"{kind}_interval"] = _interval(errors, parts)
    tilts = np.array([trial.tilt for trial in trials if trial.tilt is not None])
    found["tilt_rms"] = _rms(tilts) if len(tilts) else None
    std = np.array([one.std for _, _, one in rows]).reshape(-1, 4)
    told = np.isfinite(std).all() and np.isfinite(true).all() and len(rows) > 0
    found["coverage_90"] = coverage(expected, std**2, true, COVERED).tolist() if told else None
    return found


def displacement_errors(predicted: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,), metres, and angles (n,), radians, not negative, between displacements (n, 4).

    Where dz was not measured (NaN) the distance is that in the plane.
    """
    off = np.asarray(predicted, dtype=np.float64) - np.asarray(measured, dtype=np.float64)
    off[:, 2] = np.where(np.isnan(off[:, 2]), 0.0, off[:, 2])
    return np.linalg.norm(off[:, :3], axis=1), np.abs(wrap_angle(off[:, 3]))


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt((errors**2).mean()))


def _interval(errors: np.ndarray, parts: np.ndarray) -> list[float] | None:
    """Of the RMSE, over parts; of a single part nothing can be said."""
    groups = [errors[parts == part] for part in np.unique(parts)]
    return list(bootstrap_interval(groups, _rms)) if len(groups) > 1 else None


def tape_against_truth(trials: Sequence[Trial]) -> dict[str, Any] | None:
    """How far tape measures from what a tracker says; None where not both are known.

    A part that hung tilted in the hand lies flat when it is put down, and has moved otherwise by then: those
    are told apart, for tape cannot know.
    """
    both = [t for t in trials if t.measured is not None and t.true is not None]
    if not both:
        return None
    tilted = [t for t in both if (t.tilt or 0.0) > TILTED]
    return dict(
        flat=_tape_errors([t for t in both if t not in tilted]), tilted=_tape_errors(tilted), tilt=TILTED
    )


def _tape_errors(trials: Sequence[Trial]) -> dict[str, Any]:
    if not trials:
        return dict(trials=0)
    distance, angle = displacement_errors(
        np.array([t.true for t in trials]), np.array([t.measured for t in trials])
    )
    return dict(
        trials=len(trials),
        translation_rmse=_rms(distance),
        translation_worst=float(distance.max()),
        rotation_rmse=_rms(angle),
        rotation_worst=float(angle.max()),
    )


def worst_trials(trials: Sequence[Trial], n: int = 10) -> list[Trial]:
    """Failures of which most was expected, or predictions that were farthest off, the worst first.

    A turn counts as the way of a point 3 cm away.
    """
    failed = sorted((t for t in trials if not t.success), key=lambda t: (-(t.quality or 0.0), t.key))
    return [*failed, *sorted((t for t in trials if miss(t) is not None), key=_by_miss)][:n]


def farthest_off(trials: Sequence[Trial], n: int = 10) -> list[Trial]:
    """Measured trials whose displacement was least expected, the worst first."""
    return sorted((t for t in trials if miss(t) is not None), key=_by_miss)[:n]


def _by_miss(trial: Trial) -> tuple[float, str]:
    return -(miss(trial) or 0.0), trial.key


def miss(trial: Trial) -> float | None:
    """How far the prediction was off, metres, a radian counted as 3 cm; None where nothing was measured."""
    if trial.measured is None or trial.predicted is None:
        return None
    distance, angle = displacement_errors(np.array([trial.predicted]), np.array([trial.measured]))
    return float(np.hypot(distance[0], TURN_LENGTH * angle[0]))
