"""Trainings of several choices and seeds on the same attempts, each stored as soon as it is finished.

A folder of a training holds its networks and its predictions for each group of attempts that was asked for.
It is not made again; one that was stopped goes on at its last epoch, or from its start where networks that do
not ship are built. Two programs started on the same folder share the trainings between them, and one program
makes several at once, which keeps a GPU busy: its time goes into starting small steps.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import exclusive_lock, write_whole
from mskgrasp.learning import held_out
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.config import DeviceName, LearningConfig
from mskgrasp.learning.grasp_models import DESCRIPTION, ModelMeta, Models, load_models, save_model
from mskgrasp.learning.samples import SAMPLES_VERSION, Samples
from mskgrasp.learning.sides import Sides
from mskgrasp.learning.stage import Reporter, Stage
from mskgrasp.learning.trainer import describe_networks, train
from mskgrasp.runtime.progress import progress
from tests.benchmarks.choice import Choice, Looks, Predictions
from tests.benchmarks.training_cost import TimeLeft, cost_of
from tests.benchmarks.trainings_at_once import Job, make_at_once

_CHECKPOINT = "checkpoint.safetensors"
_MADE_OF = "made_of.json"
_Job = tuple[Choice, int]
_Make = Callable[[Choice, int, Reporter], bool]


def make_trainings(
    choices: Sequence[Choice],
    *,
    seeds: int,
    looks: Looks,
    sides: Sides,
    groups: dict[str, Tensor],
    out: Path,
    measure_s: float = 2.0,
    device: DeviceName = "cpu",
    at_once: int = 1,
) -> dict[str, list[dict[str, Predictions]]]:
    """Train every choice with every seed, unless it is stored, and predict for each group of attempts.

    Args:
        choices: What to train; a choice comes after that of ``quality_of``.
        seeds: Trainings of each, with seeds from 0.
        looks: The samples.
        sides: Attempts to train on, and those that select the epoch.
        groups: Rows of the samples by the name of the group.
        out: Folder of all trainings.
        measure_s: Seconds for which a network's steps are measured to predict the time left.
        device: Device of the networks.
        at_once: Trainings at a time, each in a process of its own.

    Returns:
        Predictions by the choice's name, seed and group.

    Raises:
        UsageError: A folder holds a training of other settings or data, or another process is still at one.
        TrainingFailed: A training in a process of its own ended with an error, which it has printed.
    """
    jobs = [(choice, seed) for seed in range(seeds) for choice in choices if seed in choice.seeds(seeds)]
    for choice, seed in jobs:
        if (folder := choice.folder(out, seed)).exists():
            _check_origin(folder, _origin(choice, seed, looks, sides, groups))
    missing = [job for job in jobs if not all(_path(out, *job, name).exists() for name in groups)]

    def make(choice: Choice, seed: int, reporter: Reporter) -> bool:
        folder = choice.folder(out, seed)
        folder.mkdir(parents=True, exist_ok=True)
        with exclusive_lock(folder) as alone:
            return alone and _make(choice, seed, looks, sides, groups, out, reporter, device)

    if at_once > 1:
        busy = make_at_once(
            _jobs(missing, looks, sides), at_once, lambda number, reporter: make(*missing[number], reporter)
        )
    else:
        busy = _made_in_turn(missing, looks, sides, make, measure_s, device)
    if busy:
        raise UsageError(f"another process trains {', '.join(busy)}; when it is done, run this again")
    return {
        choice.name: [
            {name: Predictions.read(_path(out, choice, seed, name)) for name in groups}
            for seed in choice.seeds(seeds)
        ]
        for choice in choices
    }


def _made_in_turn(
    missing: Sequence[_Job], looks: Looks, sides: Sides, make: _Make, measure_s: float, device: DeviceName
) -> list[str]:
    """Make trainings one after the other; names of those that another process is at."""
    costs = {}
    for choice, _ in missing:
        if choice.name not in costs:
            samples = choice.samples(looks.of(choice.config.network))
            costs[choice.name] = cost_of(choice, samples, choice.sides(samples, sides), measure_s, device)
    total = sum(costs[choice.name].total_s for choice, _ in missing)
    busy = []
    with progress(unit="s", total=math.ceil(total), keep=bool(missing), hidden=not missing) as bar:
        for choice, seed in missing:
            bar.set_description(f"{choice.name}, seed {seed}")
            reporter = TimeLeft(bar, costs[choice.name])
            if not make(choice, seed, reporter):
                busy.append(_name(choice, seed))
            reporter.close()
    return busy


def _jobs(missing: Sequence[_Job], looks: Looks, sides: Sides) -> list[Job]:
    """What can be made at once, with all samples read, which the processes then share."""
    found = []
    for choice, seed in missing:
        samples = choice.samples(looks.of(choice.config.network))
        steps = _steps(choice, samples, choice.sides(samples, sides))
        needs = _name(replace(choice, name=choice.quality_of), seed) if choice.quality_of else ""
        found.append(Job(name=_name(choice, seed), needs=needs, steps=steps))
    return found


def _steps(choice: Choice, samples: Samples, sides: Sides) -> int:
    """Steps of all epochs of a training."""
    n_success = int(samples.success[sides.training].sum())
    balanced = 2 * min(n_success, len(sides.training) - n_success)
    n_samples = {"gqn": balanced, "gdn": n_success}
    settings = {name: getattr(choice.config, name) for name in choice.stages()}
    return sum(one.epochs * math.ceil(n_samples[name] / one.batch_size) for name, one in settings.items())


def _name(choice: Choice, seed: int) -> str:
    return f"{choice.name} with seed {seed}"


def _path(out: Path, choice: Choice, seed: int, group: str) -> Path:
    return choice.folder(out, seed) / f"{group}.npz"


def _make(
    choice: Choice,
    seed: int,
    looks: Looks,
    sides: Sides,
    groups: dict[str, Tensor],
    out: Path,
    reporter: Reporter,
    device: DeviceName,
) -> bool:
    """Make one training; False if the quality network that it needs is still being trained."""
    folder = choice.folder(out, seed)
    if all((folder / f"{name}.npz").exists() for name in groups):
        return True  # made by another process in the meantime
    if choice.quality_of and not (_quality_folder(choice, out, seed) / DESCRIPTION).exists():
        return False
    _check_origin(folder, _origin(choice, seed, looks, sides, groups))
    config = choice.config.model_copy(update={"seed": seed})
    samples = choice.samples(looks.of(config.network))
    sides = choice.sides(samples, sides)
    models = _trained(choice, config, samples, sides, out, reporter, compute_device(device))
    for name, rows in groups.items():
        if not (path := folder / f"{name}.npz").exists():
            predicted(models, samples, rows, quality=choice.has_quality).write(path)
    return True


def _quality_folder(choice: Choice, out: Path, seed: int) -> Path:
    return replace(choice, name=choice.quality_of).folder(out, seed)


def predicted(models: Models, samples: Samples, rows: Tensor, *, quality: bool) -> Predictions:
    """Predict for some rows: the quality of all, if wanted, and the displacement of the successful ones."""
    mean, variance = held_out.predict_grasp_displacement(models, samples, rows[samples.success[rows]])
    probability = held_out.predict_quality(models, samples, rows) if quality else np.zeros(0)
    table = models.meta.calibration.intervals
    intervals = np.array(table.model_dump_json() if table else "")
    return Predictions(quality=probability, mean=mean, variance=variance, intervals=intervals)


def _trained(
    choice: Choice,
    config: LearningConfig,
    samples: Samples,
    sides: Sides,
    out: Path,
    reporter: Reporter,
    device: torch.device,
) -> Models:
    """Stored networks, or those that are trained now, from a checkpoint if there is one."""
    folder = choice.folder(out, config.seed)
    if choice.build is not None:
        return displacement_trained(choice.build, config, samples, sides, reporter, device)
    if (folder / DESCRIPTION).exists():
        return load_models(folder, device)
    quality = None
    if choice.quality_of:
        quality = load_models(_quality_folder(choice, out, config.seed)).gqn
    models, _ = train(
        samples,
        config,
        checkpoint_path=folder / _CHECKPOINT,
        device=device,
        reporter=reporter,
        sides=sides,
        quality=quality,
    )
    save_model(folder, models)
    (folder / _CHECKPOINT).unlink(missing_ok=True)
    return models


def displacement_trained(
    build: Callable[[ModelMeta], Models],
    config: LearningConfig,
    samples: Samples,
    sides: Sides,
    reporter: Reporter,
    device: torch.device | str = "cpu",
) -> Models:
    """A displacement network, trained as in `mskgrasp.learning.trainer.train`."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        models = build(describe_networks(samples, sides.training, config))
    models.gqn.to(device)
    models.gdn.to(device)
    Stage("gdn", models, samples, sides, config).run([], reporter)
    return models


def _origin(
    choice: Choice, seed: int, looks: Looks, sides: Sides, groups: dict[str, Tensor]
) -> dict[str, Any]:
    """What a training and its predictions are made of."""
    samples = choice.samples(looks.of(choice.config.network))
    sides = choice.sides(samples, sides)
    return {
        "settings": choice.config.model_copy(update={"seed": seed}).model_dump(mode="json"),
        "data": samples.fingerprint,
        "samples_version": SAMPLES_VERSION,
        "rows": _digest(sides.training, sides.validation),
        **{f"{name} grasps": _digest(rows) for name, rows in groups.items()},
    }


def _digest(*rows: Tensor) -> str:
    return hashlib.sha256(torch.cat(rows).contiguous().numpy().tobytes()).hexdigest()


def _check_origin(folder: Path, origin: dict[str, Any]) -> None:
    """Refuse a folder with a training of other settings or data."""
    path = folder / _MADE_OF
    if path.exists():
        before = json.loads(path.read_text(encoding="utf-8"))
        if changed := [name for name, value in origin.items() if before.get(name, value) != value]:
            raise UsageError(
                f"{folder} holds a training of other {' and '.join(changed)}; choose another --out"
            )
        for name in origin.keys() - before.keys():  # predicted for rows that are not known: predicted again
            (folder / f"{name.removesuffix(' grasps')}.npz").unlink(missing_ok=True)
        origin = before | origin
    write_whole(path, (json.dumps(origin, indent=1) + "\n").encode())
