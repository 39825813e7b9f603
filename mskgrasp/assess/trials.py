"""Trials of an assessment on simulated cells: look, plan, grasp, place, measure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import yaml

from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import TABLE_CLEARANCE
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.parts import Part, find_part
from mskgrasp.planning.certified import CertifiedGrasps
from mskgrasp.planning.certified_planner import CertifiedPlanner, reachable_by
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import Planner
from mskgrasp.trials.engine import TrialEngine, connected_engine
from mskgrasp.trials.placed_scenes import SceneTask
from mskgrasp.trials.placed_trial import PlacedTrial
from mskgrasp.trials.placing import trials_of_scene

PlannerName = Literal["networks", "certified"]
PLANNERS: tuple[PlannerName, PlannerName] = ("certified", "networks")
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
        spread: The resting poses of the scenes are as frequent as they are probable; else drawn at random.
    """

    source: str
    certified: CertifiedGrasps
    models: Path
    cells: dict[str, Path]
    out: Path
    seed: int
    spread: bool = True


def write_cells(out: Path, clearance: float = TABLE_CLEARANCE) -> dict[str, Path]:
    """Write the files of the simulated cells of all conditions, whose pads keep a clearance, metres."""
    found = {}
    for condition, (_, other) in CONDITIONS.items():
        path = out / f"cell-{condition.replace(' ', '_')}.yaml"
        values = {"type": "sapien", "clearance": clearance} | other
        write_whole(path, yaml.safe_dump(values, sort_keys=False).encode())
        found[condition] = path
    return found


def scene_tasks(part: Part, n_trials: int) -> list[SceneTask]:
    """Scenes of a part, the most important condition first."""
    # A part outside the cache is known by its folder alone.
    source = str(part.folder)
    return [
        SceneTask(source=source, part=part.name, condition=condition, number=number, planners=PLANNERS)
        for condition, (share, _) in CONDITIONS.items()
        for number in range(max(1, round(share * n_trials)))
    ]


@contextmanager
def trial_bench(setup: AssessSetup) -> Iterator[Callable[[SceneTask], Iterator[PlacedTrial]]]:
    """Make the trials of a scene by certified grasps and by the networks alone."""
    part = find_part(setup.source)
    nothing = replace(setup.certified, grasps=(), uncertified=(), without={})
    with ExitStack() as stack:
        found: dict[str, tuple[TrialEngine, dict[str, CertifiedPlanner]]] = {}

        def bench(condition: str) -> tuple[TrialEngine, dict[str, CertifiedPlanner]]:
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
            seeds = trial_seeds(setup.seed, part.name, task.number, spread=setup.spread)
            yield from trials_of_scene(
                engine, planners.__getitem__, part, seeds, task.trials(), setup.certified.like
            )

        yield run
