"""The trials of an experiment on one cell, one after another: what a process does, alone or beside others."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

import numpy as np

from hal import Cell, RgbdFrame, open_cell
from hal.errors import HalError
from hal.operator import Operator
from mskgrasp.core.errors import TapeDoesNotFit, UsageError
from mskgrasp.core.settings import Tape
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import GraspPlan, Planner, PlannerConfig
from mskgrasp.reports.grasp_figures import draw_plan
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.lowess import Lowess
from mskgrasp.trials.policies import Candidates, Chooser
from mskgrasp.trials.predictors import LOWESS, LowessPredictor, NetworkPredictor, Predictor
from mskgrasp.trials.trial import Policy, Trial, clear, finish, run_trial, trial_key
from mskgrasp.trials.trial_files import trial_file, write_trial


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


def scene_seed(seed: int, part: str, number: int) -> int:
    """The seed of a trial, which the part's place, the camera's errors and the candidates follow from."""
    words = [seed, zlib.crc32(part.encode()), number]
    return int(np.random.SeedSequence(words).generate_state(1)[0] >> 1)


class TrialRunner:
    """Makes trials on a connected cell.

    Raises:
        UsageError: The cell does not tell what the trials need to know, or somebody must be asked and is not
            there.
    """

    def __init__(self, cell: Cell, setup: Setup):
        if cell.tracker is None and setup.must_measure and setup.tape is None:
            raise UsageError("nothing in this cell tracks the part: measure by tape, --measure markers")
        if cell.tracker is None and setup.lowess:
            raise UsageError(
                "LOWESS needs the part's pose and nothing here tells it: leave --lowess-data away"
            )
        self._cell = cell
        self._setup = setup
        self._operator = Operator(cell, yes=setup.yes)
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
            StoppedByOperator: The operator said so.
        """
        seed = scene_seed(task.seed, task.part, task.number)
        record, no_tape = None, ""
        while record is None:
            clear(self._cell, self._recover)
            try:
                self._operator.present(self._cell, task.source, seed, name=task.key)
            except TapeDoesNotFit as error:
                no_tape = f"no room for tape: {error}"  # it lies there all the same, and may be grasped
            record = run_trial(
                self._cell,
                self._chooser(task),
                part=task.part,
                number=task.number,
                seed=seed,
                tape=self._setup.tape,
                may_move=self._may_move,
                recover=self._recover,
            )
            if record is not None and record.plan is None and self._operator.asks:
                self._operator.inform(f"{record.trial.reason}: no grasp was planned; lay the part down anew")
                record = None
        trial = replace(
            record.trial,
            family=find_part(task.source).family,
            policy=task.policy,
            chosen_by=task.chosen_by,
        )
        if trial.unmeasured and no_tape:
            trial = replace(trial, unmeasured=no_tape)
        write_trial(trial_file(self._setup.out, trial.key), record.frame, record.plan, record.after)
        yield trial
        finish(self._cell, record, self._recover)

    def _may_move(self, frame: RgbdFrame, plan: GraspPlan) -> bool:
        picture = self._setup.out / "next.png"
        if self._operator.asks:
            draw_plan(frame, plan, picture)
        return self._operator.may_move(picture, plan.summary)

    def _chooser(self, task: TrialTask) -> Chooser | Planner:
        planner = self._candidates.planner
        if planner.config.searches and planner.config.policy == task.policy and not task.chosen_by:
            return planner
        return Chooser(
            self._candidates,
            self._predictors[task.chosen_by],
            task.policy,
            task.part,
            self._cell.tracker,
        )

    def _recover(self, reason: str) -> None:
        self._operator.recover(self._cell, reason)

    def close(self) -> None:
        """Brings the arm home."""
        clear(self._cell, self._recover)


Scene = tuple[TrialTask, ...]
"""Trials that see the same: one process makes them, and looks at the scene once."""


def run_trials(setup: Setup, scenes: Sequence[Scene], n_workers: int) -> Generator[Trial, None, None]:
    """Makes the trials of scenes, each told of once its file lies there; closing it stops all.

    What comes of a trial depends neither on the number of processes nor on which of them makes it. A trial
    whose process dies, or whose simulated cell is lost, is made again by another.

    Raises:
        HalError: The one cell was lost; a real one may not be built again behind its operator's back.
        WorkerFailed: A trial failed for a reason that trying again will not mend.
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
def _trial_bench(setup: Setup) -> Iterator[Callable[[Scene], Iterator[Trial]]]:
    with trial_runner(setup) as runner:
        yield lambda scene: chain.from_iterable(map(runner.run, scene))


@contextmanager
def trial_runner(setup: Setup) -> Iterator[TrialRunner]:
    """A runner on the cell of a setup, connected until the end of the block."""
    with open_cell(setup.cell) as cell:
        runner = TrialRunner(cell, setup)
        yield runner
        runner.close()
