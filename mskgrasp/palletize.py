"""Program: grasp parts and put them where they shall lie. Run ``python -m mskgrasp.palletize --help``."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from pydantic import Field, field_validator
from rich.console import Console
from tqdm import tqdm

from hal import Cell, RgbdFrame, execute_grasp, open_cell
from hal.errors import HalError, MotionAborted, OutOfWorkspace
from mskgrasp.cli import make_folder, parse, run
from mskgrasp.config import Config
from mskgrasp.errors import NoGraspFound, NoPartFound, UsageError
from mskgrasp.evaluate import clear
from mskgrasp.geometry import Pose
from mskgrasp.grasp import centre_in_grasp_frame, object_displacement, pose_base_tcp
from mskgrasp.models import PRETRAINED, load_models
from mskgrasp.parts import find_part
from mskgrasp.placements import draw_pallet, draw_placements, print_placements, summarise_placements
from mskgrasp.placing import Target, check_place, displacement_of_point, place, place_error, place_pose
from mskgrasp.plan import SIMULATED_CELL, make_planner, present
from mskgrasp.planner import GraspPlan, Planner, PlannerConfig
from mskgrasp.runs import TRIALS, append, begin, file_digest, inputs_of, part_names, read

DESCRIPTION = """Grasps parts, puts each where it shall lie, and measures how far from that it lies then.

Every trial is made with the same grasp once for each correction: none (as if nothing moved in the hand),
predicted (by the displacement network), truth (what the tracker saw, the best that any prediction could do).
Writes placements.png, pallet.png, report.json; a stopped run goes on where it was."""

Correction = Literal["none", "predicted", "truth"]


class PalletizeConfig(Config):
    """Settings of a palletizing run."""

    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    out: Path = Path("out/palletize")
    """Folder for trials.jsonl, report.json and the pictures."""
    parts: tuple[str, ...] = ("test",)
    """Names, folders, or sets: test and validation (never seen by the model), starter, catalogue."""
    n_parts: int = Field(default=0, ge=0)
    """At most so many of these parts, evenly chosen; 0: all."""
    trials: int = Field(default=3, ge=1)
    """Trials a part; trial k goes to slot k, over and over."""
    target: str = "0.5,0.06,90"
    """Where a part shall lie: x and y of its centre in metres (base), and by how many degrees it shall be turned
    from how it lay."""
    slots: Path | None = None
    """YAML file of slots instead: a list of {x, y, theta_deg} and, if parts must fit, {width, depth}, metres."""
    corrections: tuple[Correction, ...] = ("none", "predicted", "truth")
    """What is corrected by; truth needs a cell that tracks the part."""
    seed: int = Field(default=0, ge=0)
    """Places, turns and candidates follow from it."""
    planner: PlannerConfig = PlannerConfig()
    """How grasps are chosen."""

    @field_validator("target")
    @classmethod
    def _target(cls, text: str) -> str:
        parse_target(text)
        return text


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A place on the pallet.

    Attributes:
        target: Where the part's centre goes, and how it is turned.
        size: Width and depth that there are, along base x and y, metres; None where it does not matter.
    """

    target: Target
    size: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Placement:
    """What came of one part put down once; metres and radians.

    Attributes:
        part: Name of the part.
        number: Which trial of the part.
        correction: What was corrected by.
        target: x, y, theta that were asked for.
        placed: The part was let go at the target.
        reason: Why not; empty where it was.
        grasp: (4,) the grasp; None, as what follows, where there was none.
        predicted: (4,) expected displacement of the part's seen centre in the hand.
        measured: (4,) the true one; None where nothing tracks the part.
        translation_error: Distance of the placed part's centre from its target; None where not placed.
        rotation_error: Its turn's error; None where not placed.
    """

    part: str
    number: int
    correction: str
    target: tuple[float, float, float]
    placed: bool
    reason: str
    grasp: list[float] | None = None
    predicted: list[float] | None = None
    measured: list[float] | None = None
    translation_error: float | None = None
    rotation_error: float | None = None

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Placement:
        """The placement of a line of trials."""
        return cls(**(values | {"target": tuple(values["target"])}))


def main() -> int:
    """Runs the trials and reports."""
    config = parse(PalletizeConfig, prog="python -m mskgrasp.palletize", description=DESCRIPTION)
    report = palletize(config)
    print_placements(report, Console(width=None if sys.stdout.isatty() else 110))
    print(f"wrote {config.out}/report.json, trials.jsonl, placements.png and pallet.png")
    return 0


def palletize(config: PalletizeConfig) -> dict[str, Any]:
    """Executes the trials that are missing and sums them up.

    Raises:
        UsageError: The folder holds a run with other settings, or a slot cannot be used.
    """
    models = load_models(config.models)
    names = part_names(config.parts, models.meta.training)
    if config.n_parts and config.n_parts < len(names):
        names = [names[int(i)] for i in np.linspace(0, len(names) - 1, config.n_parts)]
    slots = read_slots(config)
    inputs = inputs_of(config.cell, config.models, names)
    if config.slots is not None:
        inputs["slots"] = file_digest(config.slots)
    begin(config, config.out, inputs, may_change=("out", "trials", "parts", "n_parts"))
    make_folder(config.out / "frames")
    done = {(one.part, one.number, one.correction): one for one in read(config.out / TRIALS, Placement.from_json)}
    missing = [
        (name, number, correction)
        for name in names
        for number in range(config.trials)
        for correction in config.corrections
        if (find_part(name).name, number, correction) not in done
    ]
    if missing:
        with open_cell(config.cell) as cell:
            check_slots(cell, slots)
            if "truth" in config.corrections and cell.tracker is None:
                raise UsageError("--corrections truth: nothing in this cell tracks the part; leave it away")
            planner = make_planner(config.models, config.planner, cell)
            for name, number, correction in tqdm(missing, unit="placement", file=sys.stderr):
                clear(cell)
                slot = slots[number % len(slots)]
                one = _one(cell, planner, config, slot, (name, number, correction))
                done[one.part, one.number, one.correction] = one
                append(config.out / TRIALS, asdict(one))
            clear(cell)
    placements = [done[key] for key in sorted(done)]
    report = summarise_placements(placements)
    text = json.dumps(report, indent=1, allow_nan=False)
    (config.out / "report.json").write_text(text + "\n", encoding="utf-8")
    draw_placements(placements, config.out / "placements.png")
    return report


def _one(
    cell: Cell, planner: Planner, config: PalletizeConfig, slot: Slot, key: tuple[str, int, Correction]
) -> Placement:
    name, number, correction = key
    part = find_part(name).name
    seed = int(np.random.SeedSequence([config.seed, number]).generate_state(1)[0] >> 1)
    target = (slot.target.x, slot.target.y, slot.target.theta)
    failed = dict(part=part, number=number, correction=correction, target=target, placed=False)
    present(cell, name, seed)
    frame = cell.camera.capture()
    try:
        plan = planner.plan(frame, np.random.default_rng(seed))
    except (NoPartFound, NoGraspFound) as error:
        return Placement(**failed, reason=type(error).__name__)  # pyright: ignore[reportArgumentType]
    failed["grasp"], failed["predicted"] = plan.grasp.tolist(), plan.displacement.tolist()
    if slot.size is not None and not fits(plan.view.size[:2], slot):
        return Placement(**failed, reason="slot too small")  # pyright: ignore[reportArgumentType]
    before = None if cell.tracker is None else cell.tracker.part_pose()
    try:
        result = execute_grasp(cell, plan.grasp)
        if result.aborted is not None or not result.holding:
            if result.aborted is not None:
                cell.arm.recover()
            reason = "collided" if result.aborted is not None else "slipped" if result.lifted else "missed"
            return Placement(**failed, reason=reason)  # pyright: ignore[reportArgumentType]
        measured = None if before is None else _true_displacement(cell, plan, before, result.T_base_tcp)
        failed["measured"] = None if measured is None else measured.tolist()
        known = {"none": np.zeros(4), "predicted": plan.displacement, "truth": measured}[correction]
        assert known is not None
        pose = place_pose(plan.grasp, known, plan.view.centre_base, slot.target, cell.workspace.table_z)
        place(cell, pose)
    except OutOfWorkspace:
        return Placement(**failed, reason="OutOfWorkspace")  # pyright: ignore[reportArgumentType]
    except MotionAborted:
        cell.arm.recover()
        return Placement(**failed, reason="collided")  # pyright: ignore[reportArgumentType]
    clear(cell)
    return _measured(cell, config, plan, frame, before, slot.target, failed)


def _true_displacement(cell: Cell, plan: GraspPlan, before: Pose, T_base_tcp: Pose) -> np.ndarray:  # noqa: N803
    """(4,) of the part's seen centre, from the tracker."""
    assert cell.tracker is not None
    found, _ = object_displacement(
        pose_base_tcp(plan.grasp).inverse() @ before, T_base_tcp.inverse() @ cell.tracker.part_pose()
    )
    origin, centre = (
        centre_in_grasp_frame(point, plan.grasp) for point in (before.position, plan.view.centre_base)
    )
    return displacement_of_point(np.asarray(found), origin, centre)


def _measured(
    cell: Cell,
    config: PalletizeConfig,
    plan: GraspPlan,
    frame: RgbdFrame,
    before: Pose | None,
    target: Target,
    values: dict[str, Any],
) -> Placement:
    values = values | dict(placed=True, reason="")
    if cell.tracker is not None and before is not None:
        after = cell.tracker.part_pose()
        offset = plan.view.centre_base[:2] - before.position[:2]
        missed, turned = place_error(before, after, offset, target)
        values |= dict(translation_error=missed, rotation_error=turned)
    name = f"{values['part']}-{values['number']:03d}-{values['correction']}.png"
    draw_pallet(frame, cell.camera.capture(), plan, target, values, config.out / "frames" / name)
    return Placement(**values)


def parse_target(text: str) -> Target:
    """``x,y,theta`` in metres and degrees.

    Raises:
        ValueError: It is something else.
    """
    try:
        x, y, theta = (float(word) for word in text.split(","))
    except ValueError:
        raise ValueError(f"target {text!r} is not x,y,theta in metres and degrees, as 0.5,0.06,90") from None
    if not all(math.isfinite(value) for value in (x, y, theta)):
        raise ValueError(f"target {text!r} must be finite")
    return Target(x=x, y=y, theta=math.radians(theta))


def read_slots(config: PalletizeConfig) -> list[Slot]:
    """The slots of the file, or the one target.

    Raises:
        UsageError: The file is none of slots.
    """
    if config.slots is None:
        return [Slot(target=parse_target(config.target))]
    try:
        values = yaml.safe_load(config.slots.read_text(encoding="utf-8"))
        slots = [_slot(**entry) for entry in values]
    except OSError as error:
        raise UsageError(f"cannot read {config.slots}: {error.strerror}") from error
    except (yaml.YAMLError, TypeError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise UsageError(
            f"{config.slots} is no list of slots such as {{x: 0.5, y: 0.05, theta_deg: 90}}: {reason}"
        ) from error
    if not slots:
        raise UsageError(f"{config.slots} holds no slot")
    return slots


def _slot(
    x: float, y: float, theta_deg: float = 0.0, width: float | None = None, depth: float | None = None
) -> Slot:
    numbers = [float(value) for value in (x, y, theta_deg, width or 1.0, depth or 1.0)]
    if not all(math.isfinite(value) for value in numbers) or min(numbers[3:]) <= 0:
        raise ValueError("numbers must be finite, width and depth positive")
    if (width is None) != (depth is None):
        raise ValueError("width and depth go together")
    size = None if width is None else (numbers[3], numbers[4])
    return Slot(target=Target(x=numbers[0], y=numbers[1], theta=math.radians(numbers[2])), size=size)


def check_slots(cell: Cell, slots: list[Slot]) -> None:
    """Refuses slots that the arm cannot reach, before anything moves.

    Raises:
        UsageError: Says which.
    """
    for number, slot in enumerate(slots, 1):
        pose = np.array([slot.target.x, slot.target.y, cell.workspace.table_z + 0.02, 0.0])
        try:
            check_place(cell, pose)
        except HalError as error:
            raise UsageError(f"slot {number} at ({slot.target.x:g}, {slot.target.y:g}): {error}") from error


def fits(size: np.ndarray, slot: Slot) -> bool:
    """Whether the box of a part (2,), as it lies, turned as the slot says, fits into it."""
    assert slot.size is not None
    cos, sin = abs(math.cos(slot.target.theta)), abs(math.sin(slot.target.theta))
    turned = (cos * size[0] + sin * size[1], sin * size[0] + cos * size[1])
    return turned[0] <= slot.size[0] and turned[1] <= slot.size[1]


if __name__ == "__main__":
    run(main)
