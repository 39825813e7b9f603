"""What the displacement's error is made of: python -m tests.benchmarks.oracles --help.

Trains our displacement network without its residual blocks, each time with something that a camera does not
see, on the training parts, and measures it on the validation parts, which also select its epoch. What it
gains is what the error owes to not seeing that. No noise is added to any image, and nothing is calibrated.
"""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.config import read_config
from mskgrasp.core.errors import UsageError
from mskgrasp.dataset import open_dataset, read_columns
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import HandNetworkConfig, NetworkConfig
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides, split
from mskgrasp.parts import load_part
from mskgrasp.runtime import cli
from mskgrasp.runtime.progress import progress
from tests.benchmarks.choice import Choice, Looks
from tests.benchmarks.known_parts import evenly
from tests.benchmarks.models import facts
from tests.benchmarks.oracle_images import images
from tests.benchmarks.oracle_networks import OracleSamples, builder
from tests.benchmarks.paper_choices import CONFIGS, with_stages
from tests.benchmarks.report import show
from tests.benchmarks.scores import change_table, changes, errors_of, score_table, scores_of
from tests.benchmarks.training_cost import add_cost_options, cost_table
from tests.benchmarks.trainings import make_trainings

BASELINE = "as a camera sees it"
FAILURES_KEPT = 10
"""One in so many failures is kept: a displacement network learns from successes alone."""
_TENTH = 10
_MORE_EPOCHS = 3
"""Factor of the epochs where a tenth of the attempts is trained on."""
_FINE = {"patch_pixels": 129, "patch_columns": 65, "patch_side": 0.129}
"""Pixels of 1 mm; the patch's middle stays a pixel."""


class SuccessLooks(Looks):
    """All successes and some failures of a dataset, as our network sees them; any other asks for the same."""

    def __init__(self, data: Path, success_range: tuple[float, float], network: NetworkConfig):
        super().__init__(data, success_range)
        self._network = network
        self._reduced: Samples | None = None

    def of(self, network: NetworkConfig) -> Samples:
        """Read the samples, the same for all networks."""
        if self._reduced is None:
            whole = super().of(self._network)
            failures = torch.nonzero(~whole.success)[::FAILURES_KEPT, 0]
            rows = torch.cat([torch.nonzero(whole.success)[:, 0], failures]).sort().values
            self._reduced = rows_of(whole, rows)
            self._known.clear()
        return self._reduced


def rows_of(samples: Samples, rows: Tensor) -> Samples:
    """Some rows of samples."""
    tensors = {
        one.name: value[rows]
        for one in fields(samples)
        if isinstance(value := getattr(samples, one.name), Tensor)
    }
    return replace(samples, **tensors)


def oracle_choices(config: LearningConfig, data: Path, cache: Path) -> list[Choice]:
    """The baseline, and the same with something that a camera does not see.

    Args:
        config: Our settings.
        data: The dataset, of which masses and drawn values are read.
        cache: Folder of the images that are rendered from the parts' meshes.
    """
    network = config.network
    assert isinstance(network, HandNetworkConfig)
    fine = network.model_copy(update=_FINE)
    more = with_stages(config, epochs=_MORE_EPOCHS * config.gdn.epochs)
    exact = partial(_with_heights, cache=cache)
    plain = builder(0, 0)
    return [
        Choice(name=BASELINE, config=config, build=plain),
        Choice(
            name="exact heights, no perspective, 2 mm", config=config, build=plain,
            samples=partial(exact, network=network),
        ),
        Choice(
            name="exact heights, no perspective, 1 mm",
            config=config.model_copy(update={"network": fine}), build=plain,
            samples=partial(exact, network=fine),
        ),
        Choice(
            name="underside and sides, too", config=config, build=builder(2, 0),
            samples=partial(_with_images, network=network, cache=cache),
        ),
        Choice(
            name="mass and centre of mass, too", config=config, build=builder(0, 4),
            samples=_with_mass,
        ),
        Choice(
            name="centre of mass in place of the seen centre", config=config, build=plain,
            samples=lambda samples: replace(samples, centre_grasp=samples.origin_grasp),
        ),
        Choice(
            name="friction and force, too", config=config, build=builder(0, 2),
            samples=partial(_with_drawn, data=data),
        ),
        Choice(name="a tenth of the parts", config=more, build=plain, sides=_some_parts),
        Choice(
            name="as many grasps, of all parts", config=more, build=plain, sides=_some_grasps,
        ),
    ]  # fmt: skip


def _with_heights(samples: Samples, *, network: HandNetworkConfig, cache: Path) -> Samples:
    return replace(samples, patches=images(samples, "heights", network, cache)[:, None])


def _with(samples: Samples, **more: Any) -> OracleSamples:
    none: dict[str, Any] = {
        "more_images": samples.patches[:, :0],
        "point": None,
        "numbers": torch.zeros((len(samples), 0)),
    }
    known = {one.name: getattr(samples, one.name) for one in fields(Samples)}
    return OracleSamples(**known | none | more)


def _with_images(samples: Samples, *, network: HandNetworkConfig, cache: Path) -> Samples:
    both = [images(samples, kind, network, cache) for kind in ("underside", "sides")]
    return _with(samples, more_images=torch.stack(both, dim=1))


def _with_mass(samples: Samples) -> Samples:
    # 0.1 kg is the middle of the catalogue's masses.
    mass = torch.tensor([load_part(name).mass for name in samples.parts]) / 0.1
    metres = torch.linalg.vector_norm(samples.origin_grasp, dim=1).mean()
    return _with(
        samples, point=samples.origin_grasp / metres, numbers=mass.log()[samples.part][:, None].float()
    )


def _with_drawn(samples: Samples, *, data: Path) -> Samples:
    drawn = drawn_values(samples, data)
    unit = (drawn - drawn.mean(dim=0)) / drawn.std(dim=0).clamp(min=1e-6)
    return _with(samples, numbers=unit)


def drawn_values(samples: Samples, data: Path) -> Tensor:
    """Friction between pads and part, and force of a pad in newtons, of each attempt, (n, 2)."""
    found = torch.zeros((len(samples), 2))
    by_part: dict[str, list[Path]] = {}
    for path in open_dataset(data).paths:
        by_part.setdefault(path.stem.rpartition("-")[0], []).append(path)
    for number, name in enumerate(progress(samples.parts, unit="part", title="drawn values")):
        names = ("grasp", "friction_pad_part", "finger_force")
        shards = [read_columns(path, names)[0] for path in by_part[name]]
        theta, friction, force = (
            np.concatenate([shard[column] for shard in shards])
            for column in ("grasp", "friction_pad_part", "finger_force")
        )
        # Samples keep the order of the attempts and leave some out; the angle, a random number, finds them.
        place = {float(angle): k for k, angle in enumerate(theta[:, 3])}
        rows = torch.nonzero(samples.part == number)[:, 0]
        where = [place[float(angle)] for angle in samples.theta[rows]]
        found[rows] = torch.from_numpy(np.column_stack([friction[where], force[where]]))
    return found


def _some_parts(samples: Samples, sides: Sides) -> Sides:
    known = torch.unique(samples.part[sides.training]).tolist()
    chosen = evenly(known, max(1, len(known) // _TENTH))
    return replace(
        sides, training=sides.training[torch.isin(samples.part[sides.training], torch.tensor(chosen))]
    )


def _some_grasps(samples: Samples, sides: Sides) -> Sides:
    """As many successes as `_some_parts` has, of all parts."""
    fewer = _some_parts(samples, sides).training
    wanted = {bool(kind): int((samples.success[fewer] == kind).sum()) for kind in (True, False)}
    order = torch.randperm(len(sides.training), generator=torch.Generator().manual_seed(0))
    shuffled = sides.training[order]
    kept = [shuffled[samples.success[shuffled] == kind][:n] for kind, n in wanted.items()]
    return replace(sides, training=torch.cat(kept).sort().values)


def check_parts(data: Path) -> None:
    """Refuse a dataset of which a part has changed: its images would show another one.

    Raises:
        UsageError: The stored part differs from the one that was grasped.
    """
    checked = set()
    for path in progress(open_dataset(data).paths, unit="shard", title="check parts"):
        part = path.stem.rpartition("-")[0]
        if part in checked:
            continue
        checked.add(part)
        _, info = read_columns(path, ("success",))
        if info.part_hash != load_part(part).content_hash:
            raise UsageError(f"part {part} has changed since {data} was collected; collect it again")


def main() -> int:
    """Trains what is missing, prints the tables and writes report.json and report.md."""
    options = _options()
    torch.set_num_threads(options.threads)
    config = read_config(LearningConfig, CONFIGS / "pretrained.yaml")
    same = {"noise_std": 0.0, "calibrate": False, "success_range": (0.05, 0.40)}
    config = config.model_copy(update=same)
    if options.quick or options.epochs:
        config = with_stages(config, epochs=2 if options.quick else options.epochs)
    check_parts(options.data)
    choices = oracle_choices(config, options.data, options.out / "images")
    choices = [one for one in choices if not options.only or one.name.startswith((BASELINE, *options.only))]
    looks = SuccessLooks(options.data, config.success_range, config.network)
    samples = looks.of(config.network)
    whole = split(samples, config)
    none = whole.training[:0]
    sides = Sides(training=whole.training, validation=whole.validation, test=none, new_sizes=none)
    if options.estimate:
        show([cost_table(choices, looks, sides, seconds=options.measure)], None)
        return 0
    seeds = 1 if options.quick else options.seeds
    group = {"validation": sides.validation}
    trained = make_trainings(
        choices,
        seeds=seeds,
        looks=looks,
        sides=sides,
        groups=group,
        out=options.out,
        measure_s=0.1 if options.quick else 2.0,
    )
    rows = sides.validation
    each = {name: [one["validation"] for one in found] for name, found in trained.items()}
    rate = float(samples.success[sides.training].double().mean())
    scores = {
        name: scores_of(samples, rows, each[name], rate) for name in progress(list(each), unit="choice")
    }
    errors = {name: errors_of(samples, rows, found) for name, found in each.items()}
    relative = {name: changes(one, errors[BASELINE]) for name, one in errors.items() if name != BASELINE}
    first = scores[BASELINE]
    title = f"Errors on validation parts: {first.successes} successes of {first.parts} parts, seeds: {seeds}"
    tables = [
        score_table(scores, caption=title),
        change_table(relative, "Change of the error relative to what a camera sees"),
    ]
    values = {name: one.to_json() for name, one in scores.items()}
    n_parts = len(torch.unique(samples.part[sides.training]))
    n_success = int(samples.success[sides.training].sum())
    about = facts(samples, sides) | {
        "n": f"trained on {n_success} successes at {n_parts} parts; {title.lower()}"
    }
    show(
        tables,
        options.out,
        {"scores": values, "seeds": seeds, "epochs": config.gdn.epochs, "quick": options.quick} | about,
    )
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.oracles",
        description="Train our displacement network, without its residual blocks, with what a camera does "
        "not see, and compare.",
    )
    parser.add_argument("--data", type=Path, required=True, help="dataset folder")
    parser.add_argument("--out", type=Path, required=True, help="folder of images, trainings and reports")
    parser.add_argument("--seeds", type=int, default=3, help="trainings of each network (default 3)")
    parser.add_argument(
        "--epochs", type=int, help="of each training (default: as configs/train/pretrained.yaml says)"
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="how the wanted choices' names begin")
    add_cost_options(parser)
    return parser.parse_args()


if __name__ == "__main__":
    cli.run("oracles", main)
