"""Trials of an assessment on simulated cells: look, plan, grasp, place, measure."""

from __future__ import annotations

from collections.abc import Callable, Container, Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import yaml

from hal.errors import HalError
from mskgrasp.core.files import write_whole
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.parts import find_part
from mskgrasp.planning.certified import CertifiedGrasps
from mskgrasp.planning.certified_planner import CertifiedPlanner, reachable_by
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.engine import TrialEngine, connected_engine
from mskgrasp.trials.placed_trial import PlacedTrial
from mskgrasp.trials.placing import grasp_and_place

Means = Literal["networks", "certified"]
MEANS: tuple[Means, Means] = ("certified", "networks")
EXACT, NOISY = "exact camera", "Kinect v2 noise"
CONDITIONS: dict[str, tuple[float, dict[str, Any]]] = {
    EXACT: (1.0, {}),
    NOISY: (0.5, {"noise": "kinect2"}),
    "friction 0.3": (0.25, {"physics": {"friction_pad_part": 0.3}}),
    "friction 0.8": (0.25, {"physics": {"friction_pad_part": 0.8}}),
}
"""Share of the trials, and what differs from the simulated cell, by the condition's name."""


@dataclass(frozen=True, kw_only=True)
class AssessSetup:
    """Settings of all trials of a part.

    Attributes:
        source: Name or folder of the part.
        certified: Its certified grasps.
        models: Folder of the networks.
        cells: Files of the simulated cells by condition.
        out: Folder of the part's report.
        seed: Seed of the run.
    """

    source: str
    certified: CertifiedGrasps
    models: Path
    cells: dict[str, Path]
    out: Path
    seed: int


@dataclass(frozen=True)
class SceneTask:
    """Trials in one scene, by each of some means."""

    condition: str
    number: int
    means: tuple[Means, ...]

    def keys(self) -> list[tuple[str, int, str]]:
        """Keys of its trials: `PlacedTrial.key`."""
        return [(self.condition, self.number, one) for one in self.means]

    def without(self, found: Container[tuple[str, int, str]]) -> SceneTask | None:
        """The task less the trials that are found; None where nothing is left."""
        means = tuple(one for one, key in zip(self.means, self.keys(), strict=True) if key not in found)
        return replace(self, means=means) if means else None


def write_cells(out: Path) -> dict[str, Path]:
    """Write the files of the simulated cells of all conditions."""
    found = {}
    for condition, (_, other) in CONDITIONS.items():
        path = out / f"cell-{condition.replace(' ', '_')}.yaml"
        write_whole(path, yaml.safe_dump({"type": "sapien"} | other, sort_keys=False).encode())
        found[condition] = path
    return found


def scene_tasks(n_trials: int) -> list[SceneTask]:
    """Scenes of a part, the most important condition first."""
    return [
        SceneTask(condition, number, MEANS)
        for condition, (share, _) in CONDITIONS.items()
        for number in range(max(1, round(share * n_trials)))
    ]


def run_scenes(
    setup: AssessSetup, tasks: list[SceneTask], workers: int
) -> Generator[PlacedTrial, None, None]:
    """Run trials, yielding each; the outcome does not depend on the processes.

    Raises:
        WorkerFailed: A trial failed for a reason that repeating it cannot remove.
    """
    work = Work(
        _bench,
        setup,
        name=lambda task: f"trial {task.number} with {task.condition}",
        rest=lambda task, n: replace(task, means=task.means[n:]) if n < len(task.means) else None,
        lost_by=(HalError,),
    )
    return results(work, tasks, workers)


@contextmanager
def _bench(setup: AssessSetup) -> Iterator[Callable[[SceneTask], Iterator[PlacedTrial]]]:
    part = find_part(setup.source)
    nothing = replace(setup.certified, grasps=())
    with ExitStack() as stack:
        found: dict[str, tuple[TrialEngine, dict[Means, CertifiedPlanner]]] = {}

        def bench(condition: str) -> tuple[TrialEngine, dict[Means, CertifiedPlanner]]:
            if condition not in found:
                stack.close()
                found.clear()
                engine = stack.enter_context(
                    connected_engine(
                        setup.cells[condition], yes=True, picture=setup.out / "next.png", tape=None
                    )
                )
                planner: Planner = make_planner(setup.models, PlannerConfig().for_motion(), engine.cell)
                own = CertifiedPlanner(planner, part, setup.certified, reachable_by(engine.cell))
                found[condition] = engine, {"certified": own, "networks": own.with_grasps(nothing)}
            return found[condition]

        def run(task: SceneTask) -> Iterator[PlacedTrial]:
            engine, planners = bench(task.condition)
            seeds = trial_seeds(setup.seed, part.name, task.number)
            for means in task.means:
                trial = PlacedTrial(part=part.name, condition=task.condition, number=task.number, means=means)
                yield grasp_and_place(engine, planners[means], part, seeds, trial, setup.certified.like)

        yield run
