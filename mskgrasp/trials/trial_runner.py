"""Runner of an experiment's trials, in one process or several."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

from hal.errors import HalError
from mskgrasp.core.errors import UsageError
from mskgrasp.core.seeds import scene_seeds
from mskgrasp.core.settings import Tape
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import Planner, PlannerConfig
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.engine import TrialEngine, connected_engine
from mskgrasp.trials.lowess import Lowess
from mskgrasp.trials.measurement import finish, run_trial
from mskgrasp.trials.policies import Candidates, Chooser
from mskgrasp.trials.predictors import LOWESS, LowessPredictor, NetworkPredictor, Predictor
from mskgrasp.trials.trial import Policy, Trial, trial_key
from mskgrasp.trials.trial_files import trial_file, write_trial

SCENE_VERSION = 1
"""Raised by every change after which `TrialRunner` draws other scenes from a seed."""


@dataclass(frozen=True, kw_only=True)
class TrialTask:
    """A trial to be made.

    Attributes:
        part: Name of the part.
        source: Its name or its folder.
        number: Which trial of it; trials of one part and number see the same scene.
        seed: Of the run.
        policy: How the grasp is chosen.
        chosen_by: Label of the model whose variances choose it; empty: the run's own.
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
        return trial_key(self.part, self.number, self.chosen_by)


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What the trials of a run share.

    Attributes:
        cell: YAML file of the cell.
        models: Folder of the model whose qualities count, and that predicts where no other does.
        planner: How grasps are chosen.
        choosers: Folders of the models that choose by their variances, by label.
        lowess: LOWESS of the known parts.
        tape: Sizes of the squares of tape to measure by; None: the cell's tracker measures.
        must_measure: Trials that nothing measures are worth nothing.
        yes: Ask no operator.
        out: Folder of the run.
    """

    cell: Path
    models: Path
    planner: PlannerConfig
    out: Path
    choosers: dict[str, Path] = field(default_factory=dict)
    lowess: dict[str, Lowess] = field(default_factory=dict)
    tape: Tape | None = None
    must_measure: bool = False
    yes: bool = False


class TrialRunner:
    """Makes trials on a connected cell.

    Raises:
        UsageError: The cell lacks a tracker that the trials need.
    """

    def __init__(self, engine: TrialEngine, setup: Setup):
        cell = engine.cell
        if cell.tracker is None and setup.must_measure and setup.tape is None:
            raise UsageError("nothing in this cell tracks the part: measure by tape, --measure markers")
        if cell.tracker is None and setup.lowess:
            raise UsageError(
                "LOWESS needs the part's pose and nothing in this cell tracks it: leave --lowess-data away"
            )
        self._engine = engine
        self._setup = setup
        planner = make_planner(setup.models, setup.planner, cell)
        chunk, device = setup.planner.chunk_size, planner.models.device
        self._candidates = Candidates(planner)
        self._predictors: dict[str, Predictor] = {"": NetworkPredictor(planner.models, chunk)}
        for label, folder in setup.choosers.items():
            self._predictors[label] = NetworkPredictor(load_models(folder, device), chunk)
        if setup.lowess:
            self._predictors[LOWESS] = LowessPredictor(setup.lowess)

    def run(self, task: TrialTask) -> Iterator[Trial]:
        """Makes a trial, writes its file and yields it; only then the arm puts the part down.

        Raises:
            HalError: The cell was lost.
            StoppedByOperator: The operator ended the run.
        """
        seed, _ = scene_seeds(task.seed, task.part, task.number)
        planned = self._engine.present(task.source, seed, self._chooser(task), name=task.key)
        record = run_trial(self._engine, planned, part=task.part, number=task.number, seed=seed)
        trial = replace(
            record.trial,
            family=find_part(task.source).family,
            policy=task.policy,
            chosen_by=task.chosen_by,
        )
        write_trial(trial_file(self._setup.out, trial.key), record.frame, record.plan, record.after)
        yield trial
        finish(self._engine, record)

    def _chooser(self, task: TrialTask) -> Chooser | Planner:
        planner = self._candidates.planner
        if planner.config.searches and planner.config.policy == task.policy and not task.chosen_by:
            return planner
        return Chooser(
            self._candidates,
            self._predictors[task.chosen_by],
            task.policy,
            task.part,
            self._engine.cell.tracker,
        )


SceneTasks = tuple[TrialTask, ...]
"""Trials on one scene: one process makes them, and predicts the qualities of its candidates once."""


def run_trials(setup: Setup, scenes: Sequence[SceneTasks], n_workers: int) -> Generator[Trial, None, None]:
    """Makes the trials of scenes, each yielded once its file is written; closing it stops all.

    The outcome of a trial depends neither on the number of processes nor on which of them makes it. A trial
    whose process dies, or whose simulated cell is lost, is made again by another.

    Raises:
        HalError: The one cell was lost; a real one may not be built again behind its operator's back.
        WorkerFailed: A trial failed for a reason that another try cannot remove.
    """
    work = Work(
        _trial_bench,
        setup,
        name=lambda scene: f"trial {scene[0].key}",
        rest=lambda scene, n_told: scene[n_told:] or None,
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
        engine.home()
