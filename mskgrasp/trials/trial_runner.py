"""Runner of an experiment's trials, in one process or several."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

from hal.errors import HalError
from mskgrasp.core.errors import UsageError
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.core.settings import Tape
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.planning.certified_planner import planner_of_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.run_inputs import kept_certified
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.engine import PlansGrasps, TrialEngine, connected_engine
from mskgrasp.trials.lowess import Lowess
from mskgrasp.trials.measurement import finish, run_trial
from mskgrasp.trials.policies import Candidates, Chooser
from mskgrasp.trials.predictors import (
    LOWESS,
    LowessPredictor,
    NetworkPredictor,
    Predictor,
    missing_predictions,
    predicted_by,
)
from mskgrasp.trials.trial import Policy, Trial, trial_key
from mskgrasp.trials.trial_files import trial_file, write_trial

SCENE_VERSION = 7
"""Raised by every change after which `TrialRunner` draws other scenes from a seed."""


@dataclass(frozen=True, kw_only=True)
class TrialTask:
    """Task of a trial.

    Attributes:
        part: Name of the part.
        source: Its name or its folder.
        number: Index of the trial; trials of one part and number share a scene.
        seed: Seed of the run.
        policy: Policy of the planner.
        chosen_by: Label of the model whose variances choose the grasp; empty: the run's own model.
    """

    part: str
    source: str
    number: int
    seed: int
    policy: Policy
    chosen_by: str = ""

    @property
    def key(self) -> str:
        """As `Trial.key`."""
        return trial_key(self.part, self.number, self.chosen_by, self.policy)


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Settings of all trials of a run.

    Attributes:
        cell: YAML file of the cell.
        models: Folder of the run's own model, which predicts all qualities.
        planner: Settings of the planner.
        compared: Folders of the models that predict the grasps of the best quality, by label; those with
            variances choose grasps of their own, too.
        lowess: LOWESS of the known parts.
        tape: Sizes of the tape squares that measure; None: the cell's tracker measures.
        must_measure: Refuse a cell that cannot measure displacements.
        yes: Ask no operator.
        out: Folder of the run.
    """

    cell: Path
    models: Path
    planner: PlannerConfig
    out: Path
    compared: dict[str, Path] = field(default_factory=dict)
    lowess: dict[str, Lowess] = field(default_factory=dict)
    tape: Tape | None = None
    must_measure: bool = False
    yes: bool = False


class TrialRunner:
    """Runner of trials on a connected cell.

    Raises:
        UsageError: The trials need a tracker, and the cell has none.
    """

    def __init__(self, engine: TrialEngine, setup: Setup):
        cell = engine.cell
        if cell.tracker is None and setup.must_measure and setup.tape is None:
            raise UsageError("this cell has no tracker; measure by tape: --measure markers")
        if cell.tracker is None and setup.lowess:
            raise UsageError("LOWESS needs the part's pose, and this cell has no tracker; omit --lowess-data")
        self._engine = engine
        self._setup = setup
        planner = make_planner(setup.models, setup.planner, cell)
        chunk, device = setup.planner.chunk_size, planner.models.device
        self._candidates = Candidates(planner)
        self._known: dict[str, PlansGrasps] = {}
        self._own = NetworkPredictor(planner.models, chunk)
        self._predictors: dict[str, Predictor] = {
            label: NetworkPredictor(load_models(folder, device), chunk)
            for label, folder in setup.compared.items()
        }
        if setup.lowess:
            self._predictors[LOWESS] = LowessPredictor(setup.lowess)

    def run(self, task: TrialTask) -> Iterator[Trial]:
        """Run a trial, write its file, yield it, and only then put the part down.

        Raises:
            HalError: The cell was lost.
            StoppedByOperator: The operator ended the run.
        """
        seed, _ = trial_seeds(task.seed, task.part, task.number)
        planned = self._engine.present(task.source, seed, self._chooser(task), name=task.key)
        record = run_trial(self._engine, planned, part=task.part, number=task.number, seed=seed)
        trial = replace(
            record.trial,
            family=find_part(task.source).family,
            policy=task.policy,
            chosen_by=task.chosen_by,
        )
        # Here, in parallel, and before the frame may be left behind on another machine.
        missing = missing_predictions(trial, self._predictors)
        if missing and record.plan is not None:
            trial = predicted_by(missing, trial, record.frame, record.plan)
        write_trial(trial_file(self._setup.out, trial.key), record.frame, record.plan, record.after)
        yield trial
        finish(self._engine, record)

    def _chooser(self, task: TrialTask) -> PlansGrasps:
        planner = self._candidates.planner
        if task.policy == "certified":
            if task.source not in self._known:
                part = find_part(task.source)
                kept = kept_certified(self._setup.out, part)
                self._known = {task.source: planner_of_part(planner, self._engine.cell, part, kept)}
            return self._known[task.source]
        if not self._setup.compared:
            return planner
        return Chooser(
            self._candidates,
            self._predictors[task.chosen_by] if task.chosen_by else self._own,
            task.policy,
            task.part,
            self._engine.cell.tracker,
        )


SceneTasks = tuple[TrialTask, ...]
"""Trials in one scene, run by one process, which predicts the qualities of its candidates once."""


def run_trials(setup: Setup, scenes: Sequence[SceneTasks], n_workers: int) -> Generator[Trial, None, None]:
    """Run the trials of scenes, yielding each once its file is written; closing the generator stops all.

    The outcome of a trial does not depend on the processes. A trial whose process dies, or whose simulated
    cell is lost, is repeated by another process.

    Raises:
        HalError: The only cell was lost; a real cell is not reconnected without its operator.
        WorkerFailed: A trial failed for a reason that repeating it cannot remove.
    """
    work = Work(
        _trial_bench,
        setup,
        name=lambda scene: f"trial {scene[0].key}",
        rest=lambda scene, n_finished: scene[n_finished:] or None,
        remedy="leave its part out with --parts",
        lost_by=(HalError,),
    )
    return results(work, scenes, n_workers)


@contextmanager
def _trial_bench(setup: Setup) -> Iterator[Callable[[SceneTasks], Iterator[Trial]]]:
    picture = setup.out / "next.png"
    with connected_engine(setup.cell, yes=setup.yes, picture=picture, tape=setup.tape) as engine:
        runner = TrialRunner(engine, setup)
        yield lambda scene: chain.from_iterable(map(runner.run, scene))
        engine.leave()
