"""Record of one trial: the planned grasp and its outcome."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from mskgrasp.core.json_text import Four, Seven, Three, checked
from mskgrasp.planning.grasp_plan import PlannedBy

Policy = Literal["quality", "low_variance", "recentred", "certified"]
REFUSED = "refused"
"""Reason of a trial in which no grasp was tried, as the best predicted quality was under the bound."""
_CAPITAL = re.compile(r"(?<=.)(?=[A-Z])")
_LEGAL_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


def reason_of(error: type[Exception]) -> str:
    """Make the reason of a trial that an error ended: ``no part found`` of `NoPartFound`."""
    return _CAPITAL.sub(" ", error.__name__).lower()


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Predicted displacement of the trial's point, axes of the grasp frame, metres and radians.

    Attributes:
        mean: (4,).
        std: (4,) standard deviations; NaN where the model predicts none.
    """

    mean: Four
    std: Four


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A planned grasp and its outcome; poses in the base frame, displacements in the grasp frame.

    All displacements of a trial are of one point of the part, ``point_base``.

    Attributes:
        part: Name of the part.
        number: Index of the trial among those of the part.
        seed: Seed of the scene: determines the part's placement and the candidates.
        success: The part was lifted and held, judged by the gap of the fingers and, with a tracker, by the
            part's rise; contact and penetration are not measured.
        reason: Reason why it was not; empty where it was.
        grasp: (4,) the executed grasp; None, as the plan's other values, where no grasp was found.
        quality: Predicted probability of success; that of the best grasp where all were refused.
        point_base: (3,) the point of the part before the grasp whose displacement is predicted and measured,
            metres: its origin by the tracker, or its seen centre where markers measure or nothing tracks the
            part; None where no grasp was found.
        predicted: (4,) expected displacement, metres and radians.
        predicted_std: (4,) its standard deviations; NaN where the model predicts none.
        measured: (4,) displacement; None where not successful or not measured. dz is NaN where
            markers measured, which give the motion in the plane.
        tilt: Measured tilt, radians; None as before.
        planning_s: Planning time, seconds.
        family: Family of the part.
        policy: Policy of the planner.
        chosen_by: Label of the model whose variances chose the grasp; empty for the run's own model.
        unmeasured: Reason why a success was not measured; empty where it was.
        true: (4,) where markers measure, the displacement by the tracker; None without one.
        pose_base_obj: (7,) x y z qw qx qy qz of the part before the grasp; None without a tracker.
        predictions: Predictions of the compared models for this grasp, by label.
        refusal: Why all grasps were refused, in a line; empty where one was tried.
        planned_by: What the grasp comes from; None where none was found.
    """

    part: str
    number: int
    seed: int
    success: bool
    reason: str
    grasp: Four | None = None
    quality: float | None = None
    point_base: Three | None = None
    predicted: Four | None = None
    predicted_std: Four | None = None
    measured: Four | None = None
    tilt: float | None = None
    planning_s: float | None = None
    family: str = ""
    policy: Policy = "low_variance"
    chosen_by: str = ""
    unmeasured: str = ""
    true: Four | None = None
    pose_base_obj: Seven | None = None
    predictions: dict[str, Prediction] = field(default_factory=dict)
    refusal: str = ""
    planned_by: PlannedBy | None = None

    @property
    def key(self) -> str:
        """Name of the trial in its run."""
        return trial_key(self.part, self.number, self.chosen_by, self.policy)

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values; NaN (an unknown standard deviation, an unmeasured dz) becomes None."""
        return _nan_to_none(asdict(self))

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Trial:
        """Convert the values of `to_json` to a trial.

        Raises:
            TypeError, ValueError, KeyError: The values are not a trial, or of no stated point.
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
        trial = checked(cls(**values))
        if not _LEGAL_KEY.fullmatch(trial.key):
            raise ValueError(trial.key)
        return trial


def trial_key(part: str, number: int, chosen_by: str, policy: Policy) -> str:
    """``<part>-<number>``; ``-<model>`` where a model's variances chose the grasp, and ``-recentred``."""
    parts = [f"{part}-{number:03d}", *([chosen_by] if chosen_by else [])]
    return "-".join([*parts, *(["recentred"] if policy == "recentred" else [])])


def _nan_to_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _nan_to_none(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_nan_to_none(one) for one in value]
    return None if isinstance(value, float) and np.isnan(value) else value


def _none_to_nan(values: list[float | None] | None) -> list[float] | None:
    return None if values is None else [float("nan") if value is None else float(value) for value in values]
