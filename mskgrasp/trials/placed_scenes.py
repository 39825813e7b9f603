"""Scenes of the whole loop, each with a trial by every planner, made by several processes and stored."""

from __future__ import annotations

from collections.abc import Container, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from hal.errors import HalError
from mskgrasp.runtime.executor import Settings, WorkerContext
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.run_folder import TRIALS, append_trial, resume_trials
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.placed_trial import Key, PlacedTrial


@dataclass(frozen=True, kw_only=True)
class SceneTask:
    """Trials in one scene, one by each planner.

    Attributes:
        source: Name or folder of the part.
        part: Its name.
        condition: Name of the cell's condition.
        number: Index of the scene among those of the part with this condition.
        planners: Names of what plans the grasps.
    """

    source: str
    part: str
    condition: str
    number: int
    planners: tuple[str, ...]

    def keys(self) -> list[Key]:
        """Keys of its trials: `PlacedTrial.key`."""
        return [(self.part, self.condition, self.number, one) for one in self.planners]

    def trials(self) -> list[PlacedTrial]:
        """Its trials before they are made."""
        return [
            PlacedTrial(part=part, condition=condition, number=number, planner=planner)
            for part, condition, number, planner in self.keys()
        ]

    def without(self, found: Container[Key]) -> SceneTask | None:
        """The task less the trials that are found; None where nothing is left."""
        planners = tuple(one for one, key in zip(self.planners, self.keys(), strict=True) if key not in found)
        return replace(self, planners=planners) if planners else None


def placed_trials(
    context: WorkerContext[Settings, SceneTask, PlacedTrial],
    setup: Settings,
    tasks: Sequence[SceneTask],
    out: Path,
    workers: int,
) -> list[PlacedTrial]:
    """Make the trials of scenes, and store each in the run's folder; those that it holds are not made again.

    The trials do not depend on the number of processes.

    Args:
        context: Makes the trials of a scene, in a process.
        setup: Its settings.
        tasks: The scenes.
        out: The run's folder.
        workers: Processes.

    Returns:
        The trials of all scenes, in the order of the tasks.

    Raises:
        WorkerFailed: A trial failed for a reason that repeating it cannot remove.
    """
    path = out / TRIALS
    found = {trial.key: trial for trial in resume_trials(path, PlacedTrial.from_json)}
    missing = [left for task in tasks if (left := task.without(found)) is not None]
    keys = [key for task in tasks for key in task.keys()]
    work = Work(
        context,
        setup,
        name=lambda task: f"trial {task.number} of part '{task.part}' with {task.condition}",
        rest=lambda task, n: replace(task, planners=task.planners[n:]) if n < len(task.planners) else None,
        lost_by=(HalError,),
    )
    bar = progress(
        total=len(keys), done=sum(key in found for key in keys), unit="trial", keep=True, title="trials"
    )
    with closing(results(work, missing, workers)) as made, bar:
        for trial in made:
            append_trial(path, trial.to_json())
            found[trial.key] = trial
            bar.update()
    return [found[key] for key in keys]
