"""Trials of an experiment, and the models that it compares."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mskgrasp.core.errors import UsageError
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.run_inputs import model_digests
from mskgrasp.trials.predictors import (
    LOWESS,
    LowessPredictor,
    NetworkPredictor,
    Predictor,
    fit_lowess,
    missing_predictions,
    predicted_by,
)
from mskgrasp.trials.trial import Policy, Trial
from mskgrasp.trials.trial_files import read_trial, trial_file
from mskgrasp.trials.trial_runner import TrialTask

CERTIFIED = "certified"
"""The label of certified grasps among the models."""
CHOSEN: tuple[Policy, ...] = ("low_variance", "recentred")
"""Policies under which each model with variances chooses grasps of its own."""
# No hyphen: it separates the label from the number in a trial's name.
_TAKEN = (LOWESS, CERTIFIED)
_LABEL = re.compile(r"[A-Za-z][A-Za-z0-9_+.]*")


def model_folders(compare: Iterable[str], models: Path) -> dict[str, Path]:
    """Parse the labels and folders of the models to compare; by default only the run's own model.

    Args:
        compare: ``label=folder`` each.
        models: Folder of the run's own model.

    Raises:
        UsageError: An item is not ``label=folder`` with a legal label, or a label occurs twice.
    """
    folders: dict[str, Path] = {}
    for text in compare:
        label, _, folder = text.partition("=")
        if not folder or not _LABEL.fullmatch(label) or label.lower() in _TAKEN:
            raise UsageError(
                f"--compare {text!r}: give label=folder, for example gcip_mv=models/gcip_mv; the label has "
                f"letters, digits, '_', '+' and '.', begins with a letter, and is not {' or '.join(_TAKEN)}"
            )
        if label in folders:
            raise UsageError(f"--compare: two models are called {label!r}")
        folders[label] = Path(folder)
    own = models.resolve().name
    return folders or {own if _LABEL.fullmatch(own) and own.lower() not in _TAKEN else "model": models}


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Models whose predicted displacements are compared.

    Attributes:
        folders: Folders of the networks by label.
        predictors: All models by label.
        inputs: Digests of the networks' weights and of the grasps that LOWESS is fitted to.
    """

    folders: dict[str, Path]
    predictors: dict[str, Predictor]
    inputs: dict[str, str]

    @property
    def lowess(self) -> LowessPredictor | None:
        """LOWESS; None where it is not compared."""
        found = self.predictors.get(LOWESS)
        return found if isinstance(found, LowessPredictor) else None

    @property
    def choosers(self) -> list[str]:
        """Labels of the networks that can choose a grasp by its variance."""
        return [label for label in self.folders if self.predictors[label].has_variance]


def load_compared(
    compare: Iterable[str], models: Path, lowess_data: Path | None, parts: Mapping[str, str], chunk_size: int
) -> Compared:
    """Load the models of an experiment.

    Args:
        compare: ``label=folder`` each.
        models: Folder of the run's own model.
        lowess_data: Dataset from whose grasps of the same part LOWESS predicts; None: no LOWESS.
        parts: Content hashes of the parts, by name.
        chunk_size: As in `mskgrasp.planning.config.PlannerConfig`.

    Raises:
        BadModel, BadDataset: A folder cannot be used.
        UsageError: The dataset holds none of the parts.
    """
    folders = model_folders(compare, models)
    predictors: dict[str, Predictor] = {
        label: NetworkPredictor(load_models(folder), chunk_size) for label, folder in folders.items()
    }
    inputs: dict[str, str] = {}
    for label, folder in folders.items():
        inputs |= model_digests(folder, f"model {label}:")
    if lowess_data is not None:
        fits, digests = fit_lowess(lowess_data, parts)
        if not fits:
            raise UsageError(
                f"--lowess-data {lowess_data} holds successful grasps of none of the parts; name parts that "
                "are in it (--parts), or omit --lowess-data"
            )
        predictors[LOWESS] = LowessPredictor(fits)
        inputs |= {f"grasps of {part} for LOWESS": digest for part, digest in digests.items()}
    return Compared(folders=folders, predictors=predictors, inputs=inputs)


def own_choices(chooses: Iterable[str], compared: Compared) -> dict[str, int]:
    """Parse the numbers of trials per part in which models choose a grasp of their own, by label.

    Args:
        chooses: ``label=number`` each.
        compared: The models.

    Raises:
        UsageError: An item is not ``label=number`` with the label of a model that can choose.
    """
    legal = [*compared.choosers, *([LOWESS] if compared.lowess is not None else [])]
    found: dict[str, int] = {}
    for text in chooses:
        label, _, number = text.partition("=")
        if label not in legal or label in found or not (number.isascii() and number.isdecimal()):
            raise UsageError(
                f"--chooses {text!r}: give label=number once a model, for example "
                f"{(legal or ['ours'])[0]}=7; labels of models with variances: {', '.join(legal) or 'none'}"
            )
        found[label] = int(number)
    return found


def scenes(
    parts: Mapping[str, str],
    n_trials: int,
    seed: int,
    planner: PlannerConfig,
    compared: Compared | None,
    chooses: Mapping[str, int] | None = None,
) -> list[tuple[TrialTask, ...]]:
    """List the trials of an experiment by scene: those of one part and number share a scene.

    In the displacement experiment all models predict the grasp of the best quality. Each model with
    variances, and LOWESS, chooses two more in the scene: among the best, and among these and those recentred
    (without ``planner.recentre`` the first alone).

    Args:
        parts: Name or folder of each part as given by the user, by its name.
        n_trials: Trials per part.
        seed: Seed of the run.
        planner: Settings with the policy of the success experiment.
        compared: Models of the displacement experiment; None for the success experiment.
        chooses: Trials per part in which a model chooses, by label; a model without a number does in all.
    """
    most, found = chooses or {}, []
    for number in range(n_trials):
        for name, source in parts.items():
            task = TrialTask(part=name, source=source, number=number, seed=seed, policy=planner.policy)
            if compared is None:
                found.append((task,))
                continue
            choosers = [*compared.choosers, *([LOWESS] if _knows(compared.lowess, name) else [])]
            best = replace(task, policy="quality")
            more = [
                replace(task, policy=policy, chosen_by=one)
                for one in choosers
                if number < most.get(one, n_trials)
                for policy in CHOSEN
                if planner.recentre or policy != "recentred"
            ]
            if planner.policy == "certified":
                more.append(replace(task, policy="certified", chosen_by=CERTIFIED))
            found.append((best, *more))
    return found


def _knows(lowess: LowessPredictor | None, part: str) -> bool:
    return lowess is not None and lowess.knows(part)


def with_predictions(trial: Trial, run: Path, predictors: Mapping[str, Predictor]) -> Trial:
    """Add the models' predictions for a measured trial's grasp of the best quality, from the stored frame.

    Raises:
        BadDataset: The trial's file cannot be read.
    """
    missing = missing_predictions(trial, predictors)
    if not missing:
        return trial
    frame, plan, _ = read_trial(trial_file(run, trial.key))
    assert plan is not None  # it was measured
    return predicted_by(missing, trial, frame, plan)
