"""The displacement experiment: models beside each other, on known and on novel parts, beside the paper's."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mskgrasp.evaluate.summary import SCHEMA_VERSION, numbers, own_prediction, tape_against_truth
from mskgrasp.trials.predictors import LOWESS, Predictor
from mskgrasp.trials.trial import Policy, Prediction, Trial

POLICIES: tuple[Policy, ...] = ("quality", "low_variance")
POLICY_NAMES = {"quality": "high quality", "low_variance": "high quality and low variance"}
SIDES = ("known", "novel")

_READ_OFF = {
    "LOWESS": ((1.00, 0.155), (1.23, 0.49)),
    "OCFI-M": ((0.69, 0.295), None),
    "OCFI-M+V": ((0.76, 0.145), (0.60, 0.165)),
    "GCIP-M": ((0.46, 0.145), None),
    "GCIP-M+V": ((0.43, np.radians(8.29)), (0.24, np.radians(7.01))),
}
PAPER: dict[str, dict[str, Any]] = {
    label: {
        policy: None if bar is None else dict(translation_rmse=1e-2 * bar[0], rotation_rmse=float(bar[1]))
        for policy, bar in zip(POLICIES, bars, strict=True)
    }
    for label, bars in _READ_OFF.items()
}
"""RMSE of the paper's models, metres and radians (Zhao et al. 2019, figure 5, 50 known and 35 novel parts).

Read off the plot by a few per cent, but for those of GCIP-M+V, which the text gives.
"""


def compare(trials: Sequence[Trial], predictors: Mapping[str, Predictor]) -> dict[str, Any]:
    """What each model's predictions are worth with each policy, known and novel parts apart.

    A model's novel parts are those that it was not made from. What is not measured is absent (None).
    """
    best = [trial for trial in trials if not trial.chosen_by]
    models, policies = {}, {POLICY_NAMES["quality"]: numbers(best)}
    for label, predictor in predictors.items():
        chosen = [trial for trial in trials if trial.chosen_by == label]
        if chosen:
            policies[f"{POLICY_NAMES['low_variance']}, of {label}"] = numbers(chosen)
        models[label] = dict(
            has_variance=predictor.has_variance,
            quality=_sides(best, label, predictor),
            low_variance=_sides(chosen, label, predictor) if chosen else None,
        )
    return dict(
        schema_version=SCHEMA_VERSION,
        models=models,
        policies=policies,
        tape_against_truth=tape_against_truth(trials),
        paper=PAPER,
    )


def _sides(trials: Sequence[Trial], label: str, predictor: Predictor) -> dict[str, Any]:
    if label == LOWESS:  # it has nothing to say of other parts
        trials = [trial for trial in trials if predictor.knows(trial.part)]

    def predicted(trial: Trial) -> Prediction | None:
        return own_prediction(trial) if trial.chosen_by else trial.predictions.get(label)

    known, novel = (
        [trial for trial in trials if predictor.knows(trial.part) is side] for side in (True, False)
    )
    return dict(
        zip(("all", *SIDES), (numbers(one, predicted) for one in (trials, known, novel)), strict=True)
    )


def paper_label(label: str) -> str | None:
    """The paper's name of a model that a user calls ``gcip_mv``, ``GCIP-M+V`` or the like."""
    plain = re.sub(r"[^a-z0-9]", "", label.lower())
    return next((name for name in PAPER if re.sub(r"[^a-z0-9]", "", name.lower()) == plain), None)
