"""Trials of scenes: what is stored is not made again, whatever stopped the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from mskgrasp.runtime.run_folder import TRIALS, append_trial, read_trials
from mskgrasp.trials.placed_scenes import SceneTask, placed_trials
from mskgrasp.trials.placed_trial import PlacedTrial

TASK = SceneTask(
    source="parts/nut", part="nut", condition="exact", number=3, planners=("certified", "networks")
)


@contextmanager
def nothing_lifted(asked: list[SceneTask]) -> Iterator[Callable[[SceneTask], Iterator[PlacedTrial]]]:
    """Trials that lift nothing; says what it was asked for."""

    def make(task: SceneTask) -> Iterator[PlacedTrial]:
        asked.append(task)
        for planner in task.planners:
            yield PlacedTrial(part=task.part, condition=task.condition, number=task.number, planner=planner)

    yield make


def test_trials_that_are_found_are_left_out():
    first, second = TASK.keys()
    assert TASK.without({}) == TASK
    assert TASK.without({first}) == replace(TASK, planners=("networks",))
    assert TASK.without({first, second}) is None
    assert TASK.without({("bolt", "exact", 3, "certified"), ("nut", "noisy", 3, "certified")}) == TASK


def test_a_stopped_run_makes_what_is_missing_and_gives_all_in_the_order_of_the_tasks(tmp_path: Path):
    tasks = [TASK, replace(TASK, condition="noisy"), replace(TASK, part="bolt")]
    stored = PlacedTrial(part="nut", condition="noisy", number=3, planner="certified", lifted=True)
    append_trial(tmp_path / TRIALS, stored.to_json())
    asked: list[SceneTask] = []
    trials = placed_trials(nothing_lifted, asked, tasks, tmp_path, workers=1)
    assert asked == [tasks[0], replace(tasks[1], planners=("networks",)), tasks[2]]
    assert [trial.key for trial in trials] == [key for task in tasks for key in task.keys()]
    assert [trial.lifted for trial in trials] == [False, False, True, False, False, False]
    assert {trial.key for trial in read_trials(tmp_path / TRIALS, PlacedTrial.from_json)} == {
        trial.key for trial in trials
    }
