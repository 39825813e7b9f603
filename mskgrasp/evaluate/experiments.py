"""Experiments: their trials and the models they compare."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.learning.grasp_models import DESCRIPTION, Models, load_models
from mskgrasp.planning.planner import PlannerConfig
from mskgrasp.planning.run_inputs import model_digests
from mskgrasp.trials.predictors import (
    LOWESS,
    LowessPredictor,
    NetworkPredictor,
    Predictor,
    Seen,
    fit_lowess,
    predict_one,
)
from mskgrasp.trials.trial import Trial
from mskgrasp.trials.trial_files import read_trial, trial_file
from mskgrasp.trials.trial_runner import TrialTask

# No hyphen: it parts a label from the number of a trial.
_LABEL = re.compile(r"[A-Za-z][A-Za-z0-9_+.]*")


def open_model(folder: Path) -> Models:
    """The model of a folder that a user names.

    Raises:
        UsageError: There is none.
        BadModel: It cannot be used.
    """
    if not (folder / DESCRIPTION).is_file():
        raise UsageError(
            f"no {DESCRIPTION} in {folder}; train a model: python -m mskgrasp.train --out {folder}"
        )
    return load_models(folder)


def model_folders(compare: Iterable[str], models: Path) -> dict[str, Path]:
    """Labels and folders of the models to compare; the run's own alone where none are named.

    Args:
        compare: ``label=folder`` each.
        models: The run's own.

    Raises:
        UsageError: One is something else.
    """
    folders: dict[str, Path] = {}
    for text in compare:
        label, _, folder = text.partition("=")
        if not folder or not _LABEL.fullmatch(label) or label == LOWESS:
            raise UsageError(
                f"--compare {text!r}: give label=folder, for example gcip_mv=models/gcip_mv; the label has "
                f"letters, digits, '_', '+' and '.', begins with a letter, and is not {LOWESS!r}"
            )
        if label in folders:
            raise UsageError(f"--compare: two models are called {label!r}")
        folders[label] = Path(folder)
    own = models.resolve().name
    return folders or {own if _LABEL.fullmatch(own) and own != LOWESS else "model": models}


@dataclass(frozen=True, kw_only=True)
class Compared:
    """The models whose displacements are compared.

    Attributes:
        folders: Of the networks, by label.
        predictors: Of all models, by label.
        inputs: Digests of what they are made from.
    """

    folders: dict[str, Path]
    predictors: dict[str, Predictor]
    inputs: dict[str, str]

    @property
    def lowess(self) -> LowessPredictor | None:
        """LOWESS, where it is among them."""
        found = self.predictors.get(LOWESS)
        return found if isinstance(found, LowessPredictor) else None

    @property
    def choosers(self) -> dict[str, Path]:
        """Folders of the networks that can choose a grasp by its variance, by label."""
        return {label: path for label, path in self.folders.items() if self.predictors[label].has_variance}


def load_compared(
    compare: Iterable[str], models: Path, lowess_data: Path | None, parts: list[str], chunk_size: int
) -> Compared:
    """Loads the models of an experiment.

    Args:
        compare: ``label=folder`` each.
        models: The run's own.
        lowess_data: Dataset whose grasps of the very part LOWESS predicts from; None: no LOWESS.
        parts: Names of the parts.
        chunk_size: As in `mskgrasp.planning.planner.PlannerConfig`.

    Raises:
        BadModel, BadDataset: A folder cannot be used.
        UsageError: The dataset holds none of the parts.
    """
    folders = model_folders(compare, models)
    predictors: dict[str, Predictor] = {
        label: NetworkPredictor(open_model(folder), chunk_size) for label, folder in folders.items()
    }
    inputs: dict[str, str] = {}
    for label, folder in folders.items():
        inputs |= model_digests(folder, f"model {label}:")
    if lowess_data is not None:
        fits, digests = fit_lowess(lowess_data, parts)
        if not fits:
            raise UsageError(
                f"--lowess-data {lowess_data} holds successful grasps of none of the parts; name parts that "
                "are in it (--parts), or leave it away"
            )
        predictors[LOWESS] = LowessPredictor(fits)
        inputs |= {f"grasps of {part} for LOWESS": digest for part, digest in digests.items()}
    return Compared(folders=folders, predictors=predictors, inputs=inputs)


def scenes(
    parts: Mapping[str, str], n_trials: int, seed: int, planner: PlannerConfig, compared: Compared | None
) -> list[tuple[TrialTask, ...]]:
    """The trials of an experiment, those of one part and number together: they see the same.

    A grasp of the best quality serves every model; each that knows its variance chooses another besides.

    Args:
        parts: What the user called each part, by its name.
        n_trials: Of each part.
        seed: Of the run.
        planner: Its policy is that of the success experiment.
        compared: Models of the displacement experiment; None for the other.
    """
    found = []
    for number in range(n_trials):
        for name, word in parts.items():
            task = TrialTask(part=name, source=word, number=number, seed=seed, policy=planner.policy)
            if compared is None:
                found.append((task,))
                continue
            choosers = [*compared.choosers, *([LOWESS] if _knows(compared.lowess, name) else [])]
            best = replace(task, policy="quality")
            found.append((best, *(replace(task, policy="low_variance", chosen_by=one) for one in choosers)))
    return found


def _knows(lowess: LowessPredictor | None, part: str) -> bool:
    return lowess is not None and lowess.knows(part)


def with_predictions(trial: Trial, run: Path, predictors: Mapping[str, Predictor]) -> Trial:
    """A measured trial with what the models expected of its grasp, from the stored frame.

    Raises:
        BadDataset: The trial's file cannot be read.
    """
    if trial.measured is None or trial.point_base is None or trial.chosen_by:
        return trial
    missing = [
        label
        for label, one in predictors.items()
        if label not in trial.predictions and (label != LOWESS or one.knows(trial.part))
    ]
    if not missing:
        return trial
    frame, plan, _ = read_trial(trial_file(run, trial.key))
    assert plan is not None  # it was measured
    pose = None if trial.pose_base_obj is None else Pose.from_vector(np.array(trial.pose_base_obj))
    seen = Seen(part=trial.part, frame=frame, view=plan.view, pose_base_obj=pose)
    grasp, point = plan.grasp.as_vector(), np.array(trial.point_base)
    more = {label: predict_one(predictors[label], seen, grasp, point) for label in missing}
    return replace(trial, predictions=trial.predictions | more)
