"""Trials of a benchmark on simulated cells: every planner in the same scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.benchmark.planners import WITHOUT_POSE, Planners, PlannerSettings
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.parts import find_part
from mskgrasp.parts.alike_poses import alike_poses
from mskgrasp.trials.engine import connected_engine
from mskgrasp.trials.placed_scenes import SceneTask
from mskgrasp.trials.placed_trial import PlacedTrial
from mskgrasp.trials.placing import trials_of_scene


@dataclass(frozen=True, kw_only=True)
class BenchmarkSetup:
    """Settings of all trials.

    Attributes:
        cell: File of the simulated cell.
        planners: What the planners are made of.
        seed: Seed of the run.
    """

    cell: Path
    planners: PlannerSettings
    seed: int


def scene_tasks(
    sources: Sequence[str], condition: str, n_trials: int, planners: tuple[str, ...]
) -> list[SceneTask]:
    """Scenes of all parts, part by part."""
    names = {source: find_part(source).name for source in sources}
    return [
        SceneTask(source=source, part=names[source], condition=condition, number=number, planners=planners)
        for source in sources
        for number in range(n_trials)
    ]


@contextmanager
def trial_bench(setup: BenchmarkSetup) -> Iterator[Callable[[SceneTask], Iterator[PlacedTrial]]]:
    """Make the trials of a scene by every planner."""
    with ExitStack() as stack:
        engine = stack.enter_context(
            connected_engine(setup.cell, yes=True, picture=setup.planners.out / "next.png", tape=None)
        )
        planners = Planners(engine.cell, setup.planners, stack)
        alike: dict[str, dict[int, tuple[int, float]]] = {}

        def run(task: SceneTask) -> Iterator[PlacedTrial]:
            part = find_part(task.source)
            if task.source not in alike and not set(task.planners) <= set(WITHOUT_POSE):
                alike[task.source] = alike_poses(part)
            like = alike.get(task.source, {})
            seeds = trial_seeds(setup.seed, part.name, task.number)
            yield from trials_of_scene(
                engine, lambda name: planners.of(name, part), part, seeds, task.trials(), like
            )

        yield run
