"""Trials of a benchmark on simulated cells: every planner in the same scenes."""

from __future__ import annotations

from collections.abc import Callable, Container, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from hal.errors import HalError
from mskgrasp.benchmark.planners import WITHOUT_POSE, Planners, PlannerSettings
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.parts import find_part
from mskgrasp.parts.alike_poses import alike_poses
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.engine import connected_engine
from mskgrasp.trials.placed_trial import PlacedTrial
from mskgrasp.trials.placing import grasp_and_place

Key = tuple[str, int, str]
"""Part, number and planner of a trial."""


@dataclass(frozen=True, kw_only=True)
class BenchmarkSetup:
    """Settings of all trials.

    Attributes:
        cell: File of the simulated cell.
        condition: Its name in the trials.
        planners: What the planners are made of.
        out: Folder of the run.
        seed: Seed of the run.
    """

    cell: Path
    condition: str
    planners: PlannerSettings
    out: Path
    seed: int


@dataclass(frozen=True)
class SceneTask:
    """Trials in one scene, one by each of some planners.

    Attributes:
        source: Name or folder of the part.
        part: Its name.
        number: Index of the scene among those of the part.
        planners: Names of the planners.
    """

    source: str
    part: str
    number: int
    planners: tuple[str, ...]

    def keys(self) -> list[Key]:
        """Keys of its trials."""
        return [(self.part, self.number, name) for name in self.planners]

    def without(self, found: Container[Key]) -> SceneTask | None:
        """The task less the trials that are found; None where nothing is left."""
        left = tuple(name for name, key in zip(self.planners, self.keys(), strict=True) if key not in found)
        return replace(self, planners=left) if left else None


def key_of(trial: PlacedTrial) -> Key:
    """Key of a trial."""
    return trial.part, trial.number, trial.means


def scene_tasks(sources: Sequence[str], n_trials: int, planners: tuple[str, ...]) -> list[SceneTask]:
    """Scenes of all parts, part by part."""
    names = {source: find_part(source).name for source in sources}
    return [
        SceneTask(source, names[source], number, planners) for source in sources for number in range(n_trials)
    ]


def run_scenes(
    setup: BenchmarkSetup, tasks: Sequence[SceneTask], workers: int
) -> Generator[PlacedTrial, None, None]:
    """Run trials, yielding each; the outcome does not depend on the processes.

    Raises:
        WorkerFailed: A trial failed for a reason that repeating it cannot remove.
    """
    work = Work(
        _bench,
        setup,
        name=lambda task: f"trial {task.number} of part '{task.part}'",
        rest=lambda task, n: replace(task, planners=task.planners[n:]) if n < len(task.planners) else None,
        lost_by=(HalError,),
    )
    return results(work, tasks, workers)


@contextmanager
def _bench(setup: BenchmarkSetup) -> Iterator[Callable[[SceneTask], Iterator[PlacedTrial]]]:
    with ExitStack() as stack:
        engine = stack.enter_context(
            connected_engine(setup.cell, yes=True, picture=setup.out / "next.png", tape=None)
        )
        planners = Planners(engine.cell, setup.planners, stack)
        alike: dict[str, dict[int, tuple[int, float]]] = {}

        def run(task: SceneTask) -> Iterator[PlacedTrial]:
            part = find_part(task.source)
            if task.source not in alike and not set(task.planners) <= set(WITHOUT_POSE):
                alike[task.source] = alike_poses(part)
            like = alike.get(task.source, {})
            seeds = trial_seeds(setup.seed, part.name, task.number)
            for name in task.planners:
                trial = PlacedTrial(part=part.name, condition=setup.condition, number=task.number, means=name)
                yield grasp_and_place(engine, planners.of(name, part), part, seeds, trial, like)

        yield run
