"""Program: grasp parts and put them where they shall lie. Run ``python -m mskgrasp.palletize --help``."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
from pydantic import Field, field_validator

from hal import cell_from_yaml
from hal.operator import Operator
from mskgrasp.core.config import Config, read_yaml
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import only_here
from mskgrasp.core.seeds import scene_seeds
from mskgrasp.core.settings import Tape
from mskgrasp.learning.grasp_models import PRETRAINED, load_models
from mskgrasp.palletize.pick_and_place import PickAndPlace, Task
from mskgrasp.palletize.placements import CORRECTIONS, Correction, Placement
from mskgrasp.palletize.report import print_report, write_report
from mskgrasp.palletize.slots import Slot, check_reach, check_room, parse_target, read_slots
from mskgrasp.parts import find_part
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.for_cell import SIMULATED_CELL, make_planner
from mskgrasp.planning.planner import PlannerConfig
from mskgrasp.planning.run_inputs import inputs_of
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.options import parse
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.run_folder import TRIALS, append, begin, file_digest, read
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.trials.engine import connected_engine

DESCRIPTION = """Grasps parts, puts each where it shall lie, and measures how far from that it lies then.

Every trial is made once for each correction, with the same part in the same place: none (as if nothing
moved in the hand), predicted (by the displacement network), truth (what the tracker saw: the best that any
prediction could do). Writes report.html, report.json and pictures. Every finished placement is stored at
once; a stopped run goes on where it was.

One target for all parts: --target 0.5,0.06,90

A pallet of several: --cell configs/palletize/cell.yaml --slots configs/palletize/grid.yaml

A real cell asks its operator to lay every part, and before the arm moves (--yes: it asks nothing)."""


class PalletizeConfig(Config):
    """Settings of a palletizing run."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    out: Path = Path("out/palletize")
    """Folder for trials.jsonl, report.html and the pictures."""
    parts: tuple[str, ...] = ("test",)
    """Names, folders, or sets: test and validation (never seen by the model), starter, catalogue."""
    n_parts: int = Field(default=0, ge=0)
    """At most so many of these parts, evenly chosen; 0: all."""
    trials: int = Field(default=3, ge=1)
    """Trials a part; with --slots, pallets."""
    target: str = "0.5,0.06,90"
    """x and y of the centre, m (base), and the direction of the part's longer side from above, degrees."""
    slots: Path | None = None
    """YAML file of slots instead, filled with the parts in turn; see configs/palletize/grid.yaml."""
    corrections: tuple[Correction, ...] = ()
    """What is corrected by, of none, predicted, truth; by default all that the cell can."""
    tape: tuple[float, float] | None = None
    """Sides of the two squares of tape on every part to measure by, m, such as 0.012 0.008; by default the
    cell's tracker measures, and where it has none, nothing does."""
    seed: int = Field(default=0, ge=0)
    """Places, turns and candidates follow from it."""
    workers: int = Field(default=1, ge=1, le=256)
    """Processes, each with a simulated cell of its own; they change no result."""
    yes: bool = False
    """Ask no operator: the arm moves as soon as a grasp is planned."""
    planner: PlannerConfig = PlannerConfig()
    """How grasps are chosen."""

    @field_validator("target")
    @classmethod
    def _target(cls, text: str) -> str:
        parse_target(text)
        return text

    @field_validator("tape")
    @classmethod
    def _tape(cls, sides: tuple[float, float] | None) -> tuple[float, float] | None:
        if sides is not None:
            Tape(large=sides[0], small=sides[1])
        return sides

    def squares(self) -> Tape | None:
        """The tape to measure by."""
        return None if self.tape is None else Tape(large=self.tape[0], small=self.tape[1])

    def all_slots(self) -> list[Slot]:
        """The file's slots, or the one target."""
        return [parse_target(self.target)] if self.slots is None else read_slots(self.slots)


@dataclass(frozen=True)
class Pallet:
    """Tasks that are done one after another in the same process.

    Attributes:
        name: For the file of its picture; empty where they are not a pallet but trials each for itself.
        tasks: In their order.
        done: Keys of those that are stored already.
    """

    name: str
    tasks: tuple[Task, ...]
    done: frozenset[tuple[str, int, int, Correction]]

    @property
    def title(self) -> str:
        """For messages."""
        return self.name or f"{self.tasks[0].part}, trial {self.tasks[0].number + 1},"

    def after(self, n_told: int) -> Pallet:
        """What is left when its process died; a simulated pallet stands empty again."""
        told = [task.key for task in self.tasks if task.key not in self.done][:n_told]
        return self if self.name else replace(self, done=self.done.union(told))


def main() -> int:
    """Runs the trials and reports."""
    config = parse(PalletizeConfig, prog="python -m mskgrasp.palletize", description=DESCRIPTION)
    report = palletize(config)
    print_report(report)
    print(f"wrote {config.out}/report.html, report.json, trials.jsonl and a picture of every placement")
    return 0


def palletize(config: PalletizeConfig) -> dict[str, Any]:
    """Makes the placements that are missing and sums all up.

    Raises:
        UsageError: The folder holds a run with other settings, a slot cannot be used, or there is nobody to
            be asked.
        HalError: The cell was lost; what is finished is stored.
    """
    models = load_models(config.models)
    names = part_names(config.parts, models.meta.training, config.n_parts)
    if not names:
        raise UsageError(
            f"--parts {' '.join(config.parts)} names no part; `python -m mskgrasp.parts list` does"
        )
    slots = config.all_slots()
    corrections, asks = _check(config, slots)
    pallets = _pallets(config, names, slots, corrections)
    check_room((find_part(task.part), task.slot) for pallet in pallets for task in pallet)
    inputs = inputs_of(config.cell, config.models, names)
    if config.slots is not None:
        inputs["slots"] = file_digest(config.slots)
    may_change = ["out", "trials", "corrections", "workers", "yes"]
    # Which part comes into which slot follows from all of them.
    may_change += ["parts", "n_parts"] if config.slots is None else []
    begin(config, config.out, inputs, may_change=may_change)
    with only_here(config.out) as mine:
        if not mine:
            raise UsageError(f"another run is at work in {config.out}; wait for it, or choose another --out")
        make_folder(config.out / "placements")
        placements = _place_all(config, pallets, asks)
    return write_report(config, config.out, placements, slots)


def _check(config: PalletizeConfig, slots: list[Slot]) -> tuple[tuple[Correction, ...], bool]:
    """Refuses what cannot be done on this cell; nothing is connected, nothing moves.

    Returns:
        The corrections, and whether an operator will be asked.
    """
    cell = cell_from_yaml(config.cell)
    kind = read_yaml(config.cell).get("type")
    if config.workers > 1 and kind != "sapien":
        raise UsageError(
            f"--workers {config.workers}: {config.cell} is one cell of which there are not several"
        )
    asks = Operator(cell, yes=config.yes).asks
    if kind in ("sapien", "devices"):  # a recording answers only what comes in its order
        check_reach(cell, slots)
    can: tuple[Correction, ...] = CORRECTIONS if cell.tracker is not None else CORRECTIONS[:2]
    wanted = tuple(dict.fromkeys(config.corrections)) or can
    if not set(wanted) <= set(can):
        raise UsageError(
            f"--corrections {' '.join(wanted)}: nothing in this cell tracks the part; legal: {', '.join(can)}"
        )
    return wanted, asks


def _pallets(
    config: PalletizeConfig, names: list[str], slots: list[Slot], corrections: tuple[Correction, ...]
) -> list[list[Task]]:
    """What belongs together: the slots of a pallet, or a trial of a part under every correction."""

    def task(name: str, number: int, index: int, correction: Correction) -> Task:
        # A part may fill several slots of a pallet, each of them another scene.
        seed, _ = scene_seeds(config.seed, find_part(name).name, number * len(slots) + index)
        return Task(
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


def _place_all(config: PalletizeConfig, pallets: list[list[Task]], asks: bool) -> list[Placement]:
    found = {one.key: one for one in read(config.out / TRIALS, Placement.from_json)}
    keys = [task.key for pallet in pallets for task in pallet]
    missing = [
        Pallet(
            name=f"pallet-{pallet[0].number:03d}-{pallet[0].correction}" if config.slots is not None else "",
            tasks=tuple(pallet),
            done=frozenset(task.key for task in pallet if task.key in found),
        )
        for pallet in pallets
        if any(task.key not in found for task in pallet)
    ]
    left = sum(key not in found for key in keys)
    if missing:
        work = Work(pallet_bench, config, name=lambda one: one.title, rest=Pallet.after)
        placed = results(work, missing, config.workers)
        bar = progress(total=len(keys), done=len(keys) - left, unit="placement", keep=True, hidden=asks)
        with contextlib.closing(placed), bar:
            for placement in placed:
                if placement.key not in found:
                    append(config.out / TRIALS, placement.to_json())
                    found[placement.key] = placement
                    bar.update()
    return [found[key] for key in keys]


@contextmanager
def pallet_bench(config: PalletizeConfig) -> Iterator[Callable[[Pallet], Iterator[Placement]]]:
    """A connected cell with its planner, and the function that fills a pallet."""
    with connected_engine(
        config.cell, yes=config.yes, picture=config.out / "next.png", tape=config.squares()
    ) as engine:
        check_reach(engine.cell, config.all_slots())
        planner = make_planner(config.models, config.planner, engine.cell)
        worker = PickAndPlace(engine, planner, config.out / "placements")

        def fill(pallet: Pallet) -> Iterator[Placement]:
            for number, task in enumerate(pallet.tasks, 1):
                # A real pallet is as it was left; a simulated one is filled anew from its first slot.
                if task.key in pallet.done and (engine.cell.feeder is None or not pallet.name):
                    continue
                where = f"slot {number} of {len(pallet.tasks)}" if pallet.name else f"trial {task.number + 1}"
                yield worker.run(task, f"{where}, correction {task.correction}")
            engine.home()
            if pallet.name:
                image = worker.picture(config.all_slots())
                cv2.imwrite(str(config.out / "placements" / f"{pallet.name}.png"), image[..., ::-1])

        yield fill
