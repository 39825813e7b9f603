"""Palletizing run: its placements, in one process or several, and their report."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import cv2

from hal import cell_from_yaml
from hal.operator import Operator
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.pallet_slots import (
    Slot,
    check_parts_beside_region,
    check_room,
    check_slots_beside_region,
    check_slots_in_reach,
    chosen_slots,
)
from mskgrasp.palletize.pick_and_place import PickAndPlace, PlacementTask
from mskgrasp.palletize.placement_records import CORRECTIONS, Correction, Placement
from mskgrasp.palletize.report import write_report
from mskgrasp.palletize.summary import PlacementSummary
from mskgrasp.parts import find_part
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.for_cell import make_planner, tell_model
from mskgrasp.planning.run_inputs import BY_CONTENT, inputs_of, keep_certified
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import note, progress
from mskgrasp.runtime.run_folder import (
    TRIALS,
    append_trial,
    file_digest,
    opened_run,
    resume_trials,
)
from mskgrasp.runtime.worker_pool import Work, process_count, results
from mskgrasp.simulation.certify_parts import certify_missing
from mskgrasp.trials.cell_file import check_loads
from mskgrasp.trials.engine import connected_engine

SCENE_VERSION = 9
"""Raised by every change after which a seed makes other placements."""


@dataclass(frozen=True)
class TaskGroup:
    """Tasks done in sequence by one process: a pallet, or one trial under every correction.

    Attributes:
        name: Name of a pallet's picture; empty for a trial.
        tasks: The tasks in sequence.
        done: Keys of the stored placements.
    """

    name: str
    tasks: tuple[PlacementTask, ...]
    done: frozenset[tuple[str, int, int, Correction]]

    @property
    def title(self) -> str:
        """Title in messages."""
        return self.name or f"{self.tasks[0].part}, trial {self.tasks[0].number + 1},"

    def after(self, n_finished: int) -> TaskGroup:
        """The group without its finished tasks, after its process died; a simulated pallet is filled anew."""
        finished = [task.key for task in self.tasks if task.key not in self.done][:n_finished]
        return self if self.name else replace(self, done=self.done.union(finished))


def palletize(config: PalletizeConfig) -> PlacementSummary:
    """Make the missing placements and report on all.

    Raises:
        UsageError: The folder holds a run with other inputs, a slot cannot be used, or an operator must be
            asked but standard input is not a terminal.
        LoadTooHeavy: The arm cannot carry a part; nothing moved.
        HalError: The cell was lost; finished placements are stored.
    """
    config = config.model_copy(update={"planner": config.planner.for_motion()})
    models = load_models(config.models)
    slots = chosen_slots(config)
    corrections, asks = _check(config, slots)
    # Parts come last: those that are missing are built, which takes a while.
    names = part_names(config.parts, models.meta.training, config.n_parts)
    if not names:
        raise UsageError(
            f"--parts {' '.join(config.parts)} names no part; `python -m mskgrasp.parts list` does"
        )
    check_loads(config.cell, map(find_part, names))
    pallets = _pallets(config, names, slots, corrections)
    if untried := set(names) - {task.part for pallet in pallets for task in pallet}:
        note(
            f"{len(untried)} of {len(names)} parts are not tried: {config.slots} has room for {len(slots)}, "
            f"and is filled {config.trials} times; raise --trials to try all"
        )
    cell = cell_from_yaml(config.cell)
    pairs = [(find_part(task.part), task.slot) for pallet in pallets for task in pallet]
    check_room(pairs)
    if config.slots is not None:
        check_parts_beside_region(cell, pairs)
    inputs = inputs_of(config.cell, config.models, names)
    if config.slots is not None:
        inputs["slots"] = file_digest(config.slots)
    may_change = ["out", "trials", "corrections", "workers", "yes", *BY_CONTENT]
    # The parts determine which of them fills which slot.
    may_change += ["parts", "n_parts"] if config.slots is None else []
    tell_model(models, cell)
    with opened_run(config, config.out, inputs, scene_version=SCENE_VERSION, may_change=may_change):
        if config.planner.policy == "certified":
            certify_missing(names, config.models, config.workers, clearance=cell.workspace.pads_clearance)
            keep_certified(config.out, names)
        make_folder(config.out / "placements")
        for leftover in (config.out / "placements").glob("*.tmp"):
            leftover.unlink()
        placements = _place_all(config, pallets, asks)
        return write_report(config, config.out, placements, slots)


def _check(config: PalletizeConfig, slots: list[Slot]) -> tuple[tuple[Correction, ...], bool]:
    """Refuse settings that this cell cannot execute, without connecting it.

    Returns:
        The corrections, and whether an operator will be asked.
    """
    cell = cell_from_yaml(config.cell)
    if config.workers > 1 and not cell.simulated:
        raise UsageError(f"--workers {config.workers}: {config.cell} is one cell; omit --workers")
    if config.tape is not None and cell.simulated and not cell.draws_tape:
        raise UsageError(
            f"--tape: {config.cell} draws no tape on parts; omit --tape, or use a cell of type sapien"
        )
    asks = Operator(cell, yes=config.yes).asks
    if not cell.recorded:  # a recording replays queries in its order only
        check_slots_in_reach(cell, slots)
    if config.slots is not None:
        check_slots_beside_region(cell, slots)
    can: tuple[Correction, ...] = CORRECTIONS if cell.tracker is not None else CORRECTIONS[:2]
    wanted = tuple(dict.fromkeys(config.corrections)) or can
    if not set(wanted) <= set(can):
        raise UsageError(
            f"--corrections {' '.join(wanted)}: this cell has no tracker; legal: {', '.join(can)}"
        )
    return wanted, asks


def _pallets(
    config: PalletizeConfig, names: list[str], slots: list[Slot], corrections: tuple[Correction, ...]
) -> list[list[PlacementTask]]:
    """The tasks of each pallet, or of each trial of a part under every correction."""

    def task(name: str, number: int, index: int, correction: Correction) -> PlacementTask:
        # A part may fill several slots of a pallet, each of them another scene.
        seed, _ = trial_seeds(config.seed, find_part(name).name, number * len(slots) + index)
        return PlacementTask(
            part=name, number=number, index=index, slot=slots[index], correction=correction, seed=seed,
            keep=index > 0,
        )  # fmt: skip

    if config.slots is None:
        return [
            [task(name, number, 0, correction) for correction in corrections]
            for name in names
            for number in range(config.trials)
        ]
    return [
        [
            task(names[(number * len(slots) + index) % len(names)], number, index, correction)
            for index in range(len(slots))
        ]
        for number in range(config.trials)
        for correction in corrections
    ]


def _place_all(config: PalletizeConfig, pallets: list[list[PlacementTask]], asks: bool) -> list[Placement]:
    found = {one.key: one for one in resume_trials(config.out / TRIALS, Placement.from_json)}
    keys = [task.key for pallet in pallets for task in pallet]
    missing = [
        TaskGroup(
            name=f"pallet-{pallet[0].number:03d}-{pallet[0].correction}" if config.slots is not None else "",
            tasks=tuple(pallet),
            done=frozenset(task.key for task in pallet if task.key in found),
        )
        for pallet in pallets
        if any(task.key not in found for task in pallet)
    ]
    left = sum(key not in found for key in keys)
    if missing:
        work = Work(placement_bench, config, name=lambda one: one.title, rest=TaskGroup.after)
        workers = process_count(config.workers) if cell_from_yaml(config.cell).simulated else 1
        placed = results(work, missing, min(workers, len(missing)))
        bar = progress(total=len(keys), done=len(keys) - left, unit="placement", keep=True, hidden=asks)
        with contextlib.closing(placed), bar:
            for placement in placed:
                if placement.key not in found:
                    append_trial(config.out / TRIALS, placement.to_json())
                    found[placement.key] = placement
                    bar.update()
    return [found[key] for key in keys]


@contextmanager
def placement_bench(config: PalletizeConfig) -> Iterator[Callable[[TaskGroup], Iterator[Placement]]]:
    """Connect a cell with its planner; the function that runs a group of tasks."""
    with connected_engine(
        config.cell, yes=config.yes, picture=config.out / "next.png", tape=config.squares()
    ) as engine:
        check_slots_in_reach(engine.cell, chosen_slots(config))
        planner = make_planner(config.models, config.planner, engine.cell)
        worker = PickAndPlace(engine, planner, config.out)

        def fill(pallet: TaskGroup) -> Iterator[Placement]:
            for number, task in enumerate(pallet.tasks, 1):
                # A real pallet keeps its parts; a simulated one is filled anew from its first slot.
                if task.key in pallet.done and not pallet.name:
                    continue
                if task.key in pallet.done and engine.cell.feeder is None:
                    worker.skip(task)
                    continue
                where = f"slot {number} of {len(pallet.tasks)}" if pallet.name else f"trial {task.number + 1}"
                yield worker.run(task, f"{where}, correction {task.correction}")
            if engine.leave() and pallet.name:
                image = worker.picture(chosen_slots(config))
                _, png = cv2.imencode(".png", image[..., ::-1])
                write_whole(config.out / "placements" / f"{pallet.name}.png", png.tobytes())

        yield fill
