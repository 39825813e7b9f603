"""Record of one trial: what was planned, and its outcome."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

Policy = Literal["quality", "low_variance"]
_LEGAL_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """A model's expectation of a grasp: displacement of the trial's point, metres and radians.

    Attributes:
        mean: (4,).
        std: (4,) standard deviations; NaN where the model predicts none.
    """

    mean: list[float]
    std: list[float]


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A planned grasp and its outcome; poses in the base frame, displacements in the grasp frame.

    All displacements of a trial are of one point of the part, ``point_base``.

    Attributes:
        part: Name of the part.
        number: Index of the trial among those of the part.
        seed: Determines the part's place, its turn and the candidates.
        success: The part was lifted and held, as far as the cell can measure: the arm measures the gap of its
            fingers, a tracker how far the part has risen; neither sees contact or penetration.
        reason: Why not; empty where it was.
        grasp: (4,) the executed grasp; None, as all that follows, where no grasp was found.
        quality: Predicted.
        point_base: (3,) that point before the grasp, metres: the part's origin by the tracker, or its seen
            centre where markers measure or nothing tracks the part; None where no grasp was found.
        predicted: (4,) expected displacement, metres and radians.
        predicted_std: (4,) its standard deviations; NaN where the model predicts none.
        measured: (4,) displacement; None where not successful or not measured. Of markers, dz is NaN: they
            measure the motion in the plane.
        tilt: Measured tilt, radians, or None.
        planning_s: Seconds that planning took.
        family: Kind of part.
        policy: How the grasp was chosen.
        chosen_by: Label of the model whose variances chose it; empty where there is but one.
        unmeasured: Why a success was not measured; empty where it was.
        true: (4,) where markers measure, the displacement by the tracker; None without one.
        pose_base_obj: (7,) x y z qw qx qy qz of the part before the grasp, where a tracker reports it.
        predictions: Expectations of other models for this grasp, by label.
    """

    part: str
    number: int
    seed: int
    success: bool
    reason: str
    grasp: list[float] | None = None
    quality: float | None = None
    point_base: list[float] | None = None
    predicted: list[float] | None = None
    predicted_std: list[float] | None = None
    measured: list[float] | None = None
    tilt: float | None = None
    planning_s: float | None = None
    family: str = ""
    policy: Policy = "low_variance"
    chosen_by: str = ""
    unmeasured: str = ""
    true: list[float] | None = None
    pose_base_obj: list[float] | None = None
    predictions: dict[str, Prediction] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Name of the trial in its run, for people and for files."""
        return trial_key(self.part, self.number, self.chosen_by)

    def to_json(self) -> dict[str, Any]:
        """Plain values; NaN (an unknown deviation, a dz that was not measured) becomes None."""
        return _nan_to_none(asdict(self))

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Trial:
        """The trial that `to_json` wrote.

        Raises:
            TypeError, ValueError, KeyError: The values are no trial, or do not say of which point they are.
        """
        values = dict(values)
        if "point_base" not in values:  # predicted of one point and measured of another
            raise KeyError("point_base")
        for name in ("predicted_std", "measured"):
            values[name] = _none_to_nan(values[name])
        values["predictions"] = {
            str(label): Prediction(mean=list(one["mean"]), std=_none_to_nan(one["std"]) or [])
            for label, one in values.get("predictions", {}).items()
        }
        trial = cls(**values)
        if not _LEGAL_KEY.fullmatch(trial.key):
            raise ValueError(trial.key)
        return trial


def trial_key(part: str, number: int, chosen_by: str = "") -> str:
    """``<part>-<number>``, and ``-<model>`` where a model's variances chose the grasp."""
    return f"{part}-{number:03d}" + (f"-{chosen_by}" if chosen_by else "")


def _nan_to_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _nan_to_none(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_nan_to_none(one) for one in value]
    return None if isinstance(value, float) and np.isnan(value) else value


def _none_to_nan(values: list[float | None] | None) -> list[float] | None:
    return None if values is None else [float("nan") if value is None else float(value) for value in values]
