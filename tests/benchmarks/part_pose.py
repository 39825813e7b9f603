"""Poses of parts with known CAD, in a simulated cell. Run: python -m tests.benchmarks.part_pose --help.

Places parts at random in their resting poses, finds them in the rendered image with and without noise, and
compares with the simulator's pose. Then shows what must be refused: other parts, at random and of another
size, parts that lean, and parts that touch another.

A turn counts up to the symmetry of the resting pose, and between resting poses that look alike (`Look`).
Times are those of the whole call, on the given number of threads.
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import torch
import trimesh

from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.open_cell import open_cell
from hal.sensor_noise import NoiseModel, SensorNoise, add_noise
from mskgrasp.core.errors import NoPartFound, PartNotRecognised
from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply, twist_and_swing, wrap_angle
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.parts.select_parts import part_names
from mskgrasp.perception.part_pose import KnownPart, PartPose, PossiblePose, find_part_pose
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from tests.benchmarks.report import show

Noise = NoiseModel | Literal["kinect2, filtered"]
"""Of the simulated sensor; filtered: as a driver smooths it that preserves edges (`FILTER`)."""
FILTER = {"d": 5, "sigmaColor": 5e-3, "sigmaSpace": 1.5}
"""Of `cv2.bilateralFilter`: pixels, metres, pixels."""
BOUNDS: dict[Noise, tuple[float, float]] = {
    "off": (0.5e-3, np.radians(0.7)),
    "iid": (1e-3, np.radians(1.5)),
    "kinect2": (1e-3, np.radians(1.5)),
    "kinect2, filtered": (1e-3, np.radians(1.5)),
}
"""Errors that count as right, metres and radians, by noise."""
LEANS = (2.0, 4.0, 8.0)
"""Degrees by which parts lean that must be refused."""
_SIZE = re.compile(r"\d")
"""Where the size begins in the name of a part of the catalogue."""
CHI_SQUARED_95 = {2: 5.99, 3: 7.81}
"""What the squared error over the covariance exceeds in 5 %, by the number of unknowns."""


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A part in an image.

    Attributes:
        frame: Without noise.
        T_base_obj: The simulator's pose.
        seed: Of the placement, and of the noise.
    """

    part: str
    frame: RgbdFrame
    T_base_obj: Pose
    seed: int


@dataclass(frozen=True, kw_only=True)
class Result:
    """What was found in an image of the right part; lengths in metres, angles in radians.

    Attributes:
        refused: Whether it was taken for no pose of the part.
        unseen: Whether it was, because no part was detected.
        look: Whether the resting pose is right, or one that looks alike.
        offset: (2,) error of the place.
        turn: Error of the turn, up to symmetry.
        squared: Squared error over the covariance.
        seconds: Time of the call, and of all processors for it.
        unknowns: 3; 2 where any turn looks the same.
        named: Errors of place and turn of every pose that was named, the alternatives among them, whose look
            is right.
    """

    part: str
    seconds: tuple[float, float]
    refused: bool = False
    unseen: bool = False
    look: bool = False
    offset: np.ndarray | None = None
    turn: float = 0.0
    squared: float = 0.0
    unknowns: int = 3
    named: tuple[tuple[float, float], ...] = ()

    def within(self, bounds: tuple[float, float]) -> bool:
        """Whether it is right within bounds of place and turn."""
        return self.look and _within(self.named[0], bounds)

    def named_within(self, bounds: tuple[float, float]) -> bool:
        """Whether one of the poses that were named is."""
        return any(_within(one, bounds) for one in self.named)


def _within(error: tuple[float, float], bounds: tuple[float, float]) -> bool:
    return error[0] < bounds[0] and abs(error[1]) < bounds[1]


def shown_parts(cell: Cell, names: Sequence[str], poses: int) -> Iterator[Shown]:
    """Every part at ``poses`` random places, in resting poses by their probability."""
    assert cell.feeder is not None and cell.tracker is not None
    for name in names:
        for seed in range(poses):
            cell.feeder.present(name, seed)
            yield Shown(
                part=name, frame=cell.camera.capture(), T_base_obj=cell.tracker.part_pose(), seed=seed
            )


def with_noise(shown: Shown, model: Noise) -> tuple[RgbdFrame, float]:
    """The frame with noise, and the least height of a part in it."""
    noise = SensorNoise(model="kinect2" if model == "kinect2, filtered" else model)
    seed = [shown.seed, *shown.part.encode()]
    depth = add_noise(shown.frame.depth, shown.frame.intrinsics, noise, np.random.default_rng(seed))
    if model == "kinect2, filtered":
        depth = filtered(depth)
    return replace(shown.frame, depth=depth), noise.least_height


def filtered(depth: np.ndarray) -> np.ndarray:
    """An image as a driver smooths it; what the sensor does not see stays unseen."""
    unseen = ~np.isfinite(depth)
    smooth = cv2.bilateralFilter(np.where(unseen, np.nanmax(depth), depth).astype(np.float32), **FILTER)
    return np.where(unseen, np.nan, smooth)


Found = PartPose | PartNotRecognised | NoPartFound


def find(cell: Cell, shown: Shown, model: Noise, known: KnownPart) -> tuple[Found, tuple[float, float]]:
    """The pose found, or why the part was refused, and the time by the clock and of the processors."""
    frame, min_height = with_noise(shown, model)
    start = time.perf_counter(), time.process_time()
    try:
        found = find_part_pose(
            frame, known, table_z=cell.workspace.table_z, region=cell.workspace.region, min_height=min_height
        )
    except (PartNotRecognised, NoPartFound) as refusal:
        found = refusal
    return found, (time.perf_counter() - start[0], time.process_time() - start[1])


def result(shown: Shown, found: Found, seconds: tuple[float, float], known: KnownPart) -> Result:
    """Compare what was found with the simulator's pose."""
    if not isinstance(found, PartPose):
        unseen = not isinstance(found, PartNotRecognised)  # which is a NoPartFound, too
        return Result(part=shown.part, seconds=seconds, refused=True, unseen=unseen)
    errors = [error_of(one, shown, known) for one in (found, *found.alternatives)]
    named = tuple((float(np.linalg.norm(one[:2])), float(one[2])) for one in errors if one is not None)
    if errors[0] is None:
        return Result(part=shown.part, seconds=seconds, named=named)
    unknowns = 3 if found.symmetry else 2
    error = errors[0][:unknowns]
    squared = float(error @ np.linalg.solve(found.covariance[:unknowns, :unknowns], error))
    return Result(
        part=shown.part,
        seconds=seconds,
        look=True,
        offset=errors[0][:2],
        turn=float(errors[0][2]),
        squared=squared,
        unknowns=unknowns,
        named=named,
    )


def error_of(named: PartPose | PossiblePose, shown: Shown, known: KnownPart) -> np.ndarray | None:
    """Error (3,) of a pose: place and, up to symmetry, turn; None where another look is shown."""
    lying = {one.resting: (one, look) for look in known.looks for one in look.poses}
    true_resting, true_turn = resting_of(shown.T_base_obj, known)
    one, look = lying[named.resting]
    if true_resting not in lying or lying[true_resting][1] is not look:
        return None
    turn = 0.0
    if one.order:
        _, named_turn = resting_of(named.T_base_obj, known)
        period = 2 * np.pi / one.order
        off = named_turn + one.turn - true_turn - lying[true_resting][0].turn
        turn = (off + period / 2) % period - period / 2
    return np.array([*(named.T_base_obj.position - shown.T_base_obj.position)[:2], turn])


def resting_of(T_base_obj: Pose, known: KnownPart) -> tuple[int, float]:
    """The resting pose nearest to a pose, and the turn from it about the vertical."""
    between = quat_multiply(T_base_obj.quat_wxyz, quat_conjugate(known.part.resting.quat_wxyz))
    twist, swing = twist_and_swing(between)
    nearest = int(np.argmin(swing))
    return nearest, float(wrap_angle(twist[nearest]))


def accuracy_row(model: Noise, results: Sequence[Result]) -> list[str]:
    """Shares of the right parts, for the table."""
    accepted = [one for one in results if not one.refused]
    bounds = BOUNDS[model]

    def share(values: Sequence[bool]) -> str:
        return f"{np.mean(values):.1%}"

    return [
        model, str(len(results)), str(len(results) - len(accepted)), str(sum(one.unseen for one in results)),
        share([one.look for one in results]),
        share([one.within(bounds) for one in results]), share([one.within(bounds) for one in accepted]),
        share([one.named_within(bounds) for one in accepted]),
        share([one.squared < CHI_SQUARED_95[one.unknowns] for one in accepted if one.look]),
    ]  # fmt: skip


def error_row(model: Noise, results: Sequence[Result]) -> list[str]:
    """Median and 95th percentile of errors and times, for the table."""
    right = [one for one in results if one.look and one.offset is not None]
    place = 1e3 * np.array([np.linalg.norm(one.offset) for one in right if one.offset is not None])
    turn = np.degrees(np.abs([one.turn for one in right]))
    wall, processor = 1e3 * np.array([one.seconds for one in results]).T
    row: list[str] = [model]
    for values, digits in ((place, 2), (turn, 2), (wall, 0), (processor, 0)):
        row += [f"{np.median(values):.{digits}f}", f"{np.percentile(values, 95):.{digits}f}"]
    return row


def wrong_parts(names: Sequence[str], sizes: Sequence[str]) -> dict[str, dict[str, str]]:
    """Of every part, another one at random, and one of the catalogue of another size."""
    rng = np.random.default_rng(0)
    kinds: dict[str, dict[str, str]] = {"another part": {}, "another size": {}}
    families: dict[str, list[str]] = {}
    for name in sorted(sizes):
        families.setdefault(_SIZE.split(name)[0], []).append(name)
    for name in names:
        if len(names) > 1:
            kinds["another part"][name] = str(rng.choice([one for one in names if one != name]))
        family = families.get(_SIZE.split(name)[0], [])
        if name in family and len(family) > 1:
            number = family.index(name)
            kinds["another size"][name] = family[number + 1 if number + 1 < len(family) else number - 1]
    return kinds


def leaning(cell: Cell, shown: Shown, degrees: float, known: KnownPart) -> Shown:
    """A part with one end raised, its lowest point on the table (the MuJoCo cell)."""
    corners = np.asarray(trimesh.load_mesh(known.part.mesh_path).vertices)
    surface = shown.T_base_obj.apply(corners)
    _, axes = np.linalg.eigh(np.cov(surface[:, :2].T))
    half = np.radians(degrees) / 2
    # About the short axis: a round part that turns about its long one rolls to where it rests as well.
    tilt = np.array([np.cos(half), *(np.sin(half) * axes[:, 0]), 0.0])
    pose = Pose(position=shown.T_base_obj.position, quat_wxyz=quat_multiply(tilt, shown.T_base_obj.quat_wxyz))
    lift = cell.workspace.table_z - pose.apply(corners)[:, 2].min()
    return show_at(cell, shown, Pose(position=pose.position + [0, 0, lift], quat_wxyz=pose.quat_wxyz))


def show_at(cell: Cell, shown: Shown, T_base_obj: Pose) -> Shown:
    """The part at any pose, held by nothing (the MuJoCo cell: its camera simulates no physics)."""
    feeder: Any = cell.feeder
    feeder.present(shown.part, shown.seed)
    feeder.simulation.data.joint("part0").qpos[:] = T_base_obj.as_vector()
    return replace(shown, frame=cell.camera.capture(), T_base_obj=T_base_obj)


def touching(shown: Shown, table_z: float) -> Shown:
    """The part with a copy of its pixels beside it."""
    frame = shown.frame
    table = float(np.nanmax(frame.depth))
    mask = (frame.depth < table - 0.002).astype(np.uint8)
    columns = np.flatnonzero(mask.any(axis=0))
    side = -1 if columns[0] > frame.depth.shape[1] - columns[-1] else 1
    widest = int(columns[-1] - columns[0])
    width = 1 + max(n for n in range(widest + 1) if (mask & np.roll(mask, side * n, axis=1)).any())
    moved = np.full_like(frame.depth, table)
    # Pixels of an overhead image: the copy's sides are seen as the part's.
    rows, columns = np.nonzero(mask)
    inside = (columns + side * width >= 0) & (columns + side * width < mask.shape[1])
    rows, columns = rows[inside], columns[inside]
    moved[rows, columns + side * width] = frame.depth[rows, columns]
    return replace(shown, frame=replace(frame, depth=np.fmin(frame.depth, moved)))


def main() -> int:
    """Prints a table of the right parts, and one of what must be refused."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--parts", nargs="+", default=["validation:45"], help="as of evaluate (default: validation:45)"
    )
    parser.add_argument("--poses", type=int, default=6, help="placements of each part (default 6)")
    parser.add_argument(
        "--cell", type=Path, default=Path("configs/cells/sapien.yaml"), help="cell of the right parts"
    )
    parser.add_argument(
        "--mujoco", type=Path, default=Path("configs/cells/mujoco.yaml"), help="cell of leaning parts"
    )
    parser.add_argument(
        "--noise", nargs="+", choices=list(BOUNDS), default=["off", "kinect2", "kinect2, filtered"]
    )
    parser.add_argument("--threads", type=int, default=2, help="of torch (default 2; 1 on a busy machine)")
    parser.add_argument("--out", type=Path, help="folder for report.json")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    training = load_models(PRETRAINED).meta.training
    names = part_names(options.parts, training)
    known = {name: KnownPart.of(find_part(name)) for name in progress(names, unit="part", title="prepare")}
    results: dict[Noise, list[Result]] = {model: [] for model in options.noise}
    refused: dict[tuple[str, Noise], list[bool]] = {}
    kinds = wrong_parts(names, training["validation_parts"])
    extra = {other for pairs in kinds.values() for other in pairs.values()} - set(known)
    known |= {
        name: KnownPart.of(find_part(name)) for name in progress(sorted(extra), unit="part", title="others")
    }
    with open_cell(options.cell) as cell:
        every = shown_parts(cell, names, options.poses)
        for shown in progress(every, unit="image", total=len(names) * options.poses, title="right parts"):
            for model in options.noise:
                found, seconds = find(cell, shown, model, known[shown.part])
                results[model].append(result(shown, found, seconds, known[shown.part]))
                if shown.seed >= 2:
                    continue
                for kind, pairs in kinds.items():
                    if shown.part in pairs:
                        other, _ = find(cell, shown, model, known[pairs[shown.part]])
                        refused.setdefault((kind, model), []).append(isinstance(other, Exception))
                other, _ = find(cell, touching(shown, cell.workspace.table_z), model, known[shown.part])
                refused.setdefault(("two that touch", model), []).append(isinstance(other, Exception))
    with open_cell(options.mujoco) as cell:
        for shown in progress(
            shown_parts(cell, names, 1), unit="image", total=len(names), title="leaning parts"
        ):
            for degrees in LEANS:
                tilted = leaning(cell, shown, degrees, known[shown.part])
                for model in options.noise:
                    other, _ = find(cell, tilted, model, known[shown.part])
                    refused.setdefault((f"leans by {degrees:g} degrees", model), []).append(
                        isinstance(other, Exception)
                    )
    wrong = [(kind, model, str(len(one)), f"{np.mean(one):.1%}") for (kind, model), one in refused.items()]
    show(
        [
            Table(
                header=("noise", "images", "refused", "of them unseen", "resting pose right", "within bounds",
                        "within bounds, of accepted images", "found pose or an alternative within bounds",
                        "inside 95 % ellipse"),
                rows=[accuracy_row(model, found) for model, found in results.items()],
                caption="Parts by themselves",
            ),
            Table(
                header=("noise", "mm, median", "mm, 95 %", "deg, median", "deg, 95 %", "ms, median",
                        "ms, 95 %", "processor ms, median", "processor ms, 95 %"),
                rows=[error_row(model, found) for model, found in results.items()],
                caption="Errors where the resting pose is right, and time of a call",
            ),
            Table(header=("shown", "noise", "images", "refused"), rows=wrong, caption="What must be refused"),
        ],
        options.out,
    )  # fmt: skip
    return 0


if __name__ == "__main__":
    cli.run("part_pose", main)
