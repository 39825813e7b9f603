"""Trials of a stored run of mskgrasp.evaluate or mskgrasp.palletize: the fields that both have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.runtime.run_folder import TRIALS, read_trials
from mskgrasp.trials.trial import Trial
from mskgrasp.trials.trial_files import trial_file


@dataclass(frozen=True, kw_only=True)
class StoredTrial:
    """A trial of a run.

    Attributes:
        name: Name of the trial.
        part: Name of the part.
        outcome: In words.
        file: Its frames and plan; None: not stored.
        picture: Its picture; None: not stored.
        grasp: (4,) executed grasp, base frame; None where none was found.
        predicted: (4,) expected displacement, axes of the grasp frame, metres and radians; None likewise.
        measured: (4,) measured one; NaN in dz where it was not measured; None where nothing was.
        point_base: (3,) the point that both are of, base frame; None: the seen centre.
        T_base_obj: The part before the grasp; None where nothing tracked it.
        target: (3,) x, y and direction of the place where the part was put; None: nowhere.
    """

    name: str
    part: str
    outcome: str
    file: Path | None = None
    picture: Path | None = None
    grasp: np.ndarray | None = None
    predicted: np.ndarray | None = None
    measured: np.ndarray | None = None
    point_base: np.ndarray | None = None
    T_base_obj: Pose | None = None
    target: np.ndarray | None = None


def read_run(folder: Path) -> list[StoredTrial]:
    """Read the trials of a run.

    Raises:
        UsageError: The folder holds no run, or one of another program.
        BadDataset: A line of the file of trials is not a trial.
    """
    path = folder / TRIALS
    if not path.is_file():
        raise UsageError(f"no run of evaluate or palletize in {folder}: there is no {TRIALS}")
    lines = read_trials(path, dict)
    if not lines:
        raise UsageError(f"{path} holds no trial yet; wait for the first one")
    if "point_base" in lines[0] and "seed" in lines[0]:
        return read_trials(path, lambda values: _evaluated(folder, Trial.from_json(values)))
    if "slot" in lines[0] and "correction" in lines[0]:
        return read_trials(path, lambda values: _placed(folder, values))
    raise UsageError(f"{path} is of another program; legal: runs of mskgrasp.evaluate and mskgrasp.palletize")


def _evaluated(folder: Path, trial: Trial) -> StoredTrial:
    file = trial_file(folder, trial.key)
    outcome = "lifted" if trial.success else f"not lifted ({trial.reason})"
    if trial.refusal:
        outcome += f": {trial.refusal}"
    pose = _array(trial.pose_base_obj)
    return StoredTrial(
        name=trial.key,
        part=trial.part,
        outcome=outcome,
        file=file if file.is_file() else None,
        grasp=_array(trial.grasp),
        predicted=_array(trial.predicted),
        measured=_array(trial.measured),
        point_base=_array(trial.point_base),
        T_base_obj=None if pose is None else Pose.from_vector(pose.reshape(7)),
    )


def _placed(folder: Path, values: dict[str, Any]) -> StoredTrial:
    name = f"{values['part']}-{values['number']:03d}-{values['slot']:02d}-{values['correction']}"
    picture = folder / "placements" / f"{name}.png"
    error = values.get("translation_error")
    missed = "" if error is None else f", {1e3 * error:.1f} mm from the target"
    outcome = f"placed{missed}" if values["placed"] else f"not placed ({values['reason']})"
    return StoredTrial(
        name=name,
        part=values["part"],
        outcome=f"{outcome}; correction: {values['correction']}",
        picture=picture if picture.is_file() else None,
        grasp=_array(values.get("grasp"), 4),
        predicted=_array(values.get("predicted"), 4),
        measured=_array(values.get("measured"), 4),
        target=_array(values["target"], 3),
    )


def _array(values: Any, size: int | None = None) -> np.ndarray | None:
    """Numbers of a trial; ValueError where there are not so many. `Trial.from_json` has counted its own."""
    if values is None:
        return None
    array = np.array(values, dtype=np.float64)
    if size is not None and array.shape != (size,):
        raise ValueError(f"{values} are not {size} numbers")
    return array
