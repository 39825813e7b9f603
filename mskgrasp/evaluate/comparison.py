"""The displacement experiment: errors of models on known and novel parts, and those of the paper's models."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mskgrasp.evaluate.experiments import CERTIFIED, CHOSEN
from mskgrasp.evaluate.summary import (
    SCHEMA_VERSION,
    TapeComparison,
    TrialStatistics,
    compare_tape,
    own_prediction,
)
from mskgrasp.trials.predictors import LOWESS, Predictor
from mskgrasp.trials.trial import Policy, Prediction, Trial

Side = Literal["known", "novel"]
Group = Literal["all", "known", "novel"]
PAPER_POLICIES: tuple[Policy, ...] = ("quality", "low_variance")
POLICIES: tuple[Policy, ...] = (*PAPER_POLICIES, "recentred")
POLICY_NAMES: dict[Policy, str] = {
    "quality": "high quality", "low_variance": "high quality and low variance",
    "recentred": "low variance, recentred", "certified": "certified grasps",
}  # fmt: skip
SIDES: tuple[Side, ...] = ("known", "novel")
GROUPS: tuple[Group, ...] = ("all", *SIDES)
"""Pooled, as in the paper, and apart."""


@dataclass(frozen=True, kw_only=True)
class PaperErrors:
    """RMSE of a model of the paper, metres and radians."""

    translation_rmse: float
    rotation_rmse: float


_READ_OFF = {
    "LOWESS": ((1.00, 0.155), (1.23, 0.49)),
    "OCFI-M": ((0.69, 0.295), None),
    "OCFI-M+V": ((0.76, 0.145), (0.60, 0.165)),
    "GCIP-M": ((0.46, 0.145), None),
    "GCIP-M+V": ((0.43, np.radians(8.29)), (0.24, np.radians(7.01))),
}
PAPER: dict[str, dict[Policy, PaperErrors | None]] = {
    label: {
        policy: bar and PaperErrors(translation_rmse=1e-2 * bar[0], rotation_rmse=float(bar[1]))
        for policy, bar in zip(PAPER_POLICIES, bars, strict=True)
    }
    for label, bars in _READ_OFF.items()
}
"""Errors of the paper's models (Zhao et al. 2019, figure 5, 50 known and 35 novel parts).

Read off the plot to a few per cent, except those of GCIP-M+V, which the text states.
"""


@dataclass(frozen=True, kw_only=True)
class PolicyStatistics:
    """Statistics of one model under one policy, by whether the model was trained on the part."""

    all: TrialStatistics
    known: TrialStatistics
    novel: TrialStatistics


@dataclass(frozen=True, kw_only=True)
class ModelStatistics:
    """Statistics of one model by policy; None where its variances chose no grasp."""

    has_variance: bool
    quality: PolicyStatistics
    low_variance: PolicyStatistics | None
    recentred: PolicyStatistics | None = None

    def of(self, policy: Policy, group: Group) -> TrialStatistics | None:
        """The statistics under a policy on all, on known or on novel parts."""
        each = {"quality": self.quality, "low_variance": self.low_variance, "recentred": self.recentred}
        found = each.get(policy)
        return found and {"all": found.all, "known": found.known, "novel": found.novel}[group]

    def rows(self, policy: Policy, group: Group) -> list[tuple[str, TrialStatistics]]:
        """The row of a table for a group, with its name; none where it has no trial or repeats another.

        At most one. Where all parts are known, or all novel, one row says so; LOWESS predicts known parts.
        """
        each = {one: self.of(policy, one) for one in SIDES}
        sides = [name for name, one in each.items() if one is not None and one.trials]
        found = self.of(policy, group)
        if found is None or not sides or (group != "all" and len(sides) == 1):
            return []
        return [(f"all, {sides[0]}" if len(sides) == 1 else group, found)] if found.trials else []


@dataclass(frozen=True, kw_only=True)
class DisplacementSummary:
    """Errors of models by label and success by policy, beside the errors of the paper's models."""

    experiment: Literal["displacement"] = "displacement"
    schema_version: int = SCHEMA_VERSION
    models: dict[str, ModelStatistics]
    policies: dict[str, TrialStatistics]
    tape_against_truth: TapeComparison | None
    paper: dict[str, dict[Policy, PaperErrors | None]]


def compare_models(trials: Sequence[Trial], predictors: Mapping[str, Predictor]) -> DisplacementSummary:
    """Compute the errors of each model's predictions under each policy, on known and on novel parts."""
    best = [trial for trial in trials if not trial.chosen_by]
    models, policies = {}, {POLICY_NAMES["quality"]: TrialStatistics.of(best)}
    for label, predictor in predictors.items():
        chosen = {}
        for policy in CHOSEN:
            own = [trial for trial in trials if (trial.chosen_by, trial.policy) == (label, policy)]
            if own:
                policies[f"{POLICY_NAMES[policy]}, of {label}"] = TrialStatistics.of(own)
                chosen[policy] = _statistics(own, label, predictor)
        models[label] = ModelStatistics(
            has_variance=predictor.has_variance,
            quality=_statistics(best, label, predictor),
            low_variance=chosen.get("low_variance"),
            recentred=chosen.get("recentred"),
        )
    certified = [trial for trial in trials if trial.chosen_by == CERTIFIED]
    if certified:
        policies[POLICY_NAMES["certified"]] = TrialStatistics.of(certified)
    return DisplacementSummary(
        models=models, policies=policies, tape_against_truth=compare_tape(trials), paper=PAPER
    )


def _statistics(trials: Sequence[Trial], label: str, predictor: Predictor) -> PolicyStatistics:
    if label == LOWESS:  # fitted to known parts, it predicts no others
        trials = [trial for trial in trials if predictor.knows(trial.part)]

    def predicted(trial: Trial) -> Prediction | None:
        return own_prediction(trial) if trial.chosen_by else trial.predictions.get(label)

    return PolicyStatistics(
        all=TrialStatistics.of(trials, predicted),
        known=TrialStatistics.of([trial for trial in trials if predictor.knows(trial.part)], predicted),
        novel=TrialStatistics.of([trial for trial in trials if not predictor.knows(trial.part)], predicted),
    )


def figure_names(labels: Iterable[str]) -> dict[str, str]:
    """Assign names in the figure to labels: the paper's, except where another label has taken it."""
    found: dict[str, str] = {}
    for label in labels:
        name = paper_label(label) or label
        found[label if name in found else name] = label
    return found


def paper_label(label: str) -> str | None:
    """Find the paper's name of a model that a user calls ``gcip_mv``, ``GCIP-M+V`` or the like."""
    plain = re.sub(r"[^a-z0-9]", "", label.lower())
    return next((name for name in PAPER if re.sub(r"[^a-z0-9]", "", name.lower()) == plain), None)
