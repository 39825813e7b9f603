"""Training run on a dataset: ``python -m mskgrasp.train --data DIR --out DIR``."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from contextlib import closing
from functools import partial, reduce
from pathlib import Path

import torch

from mskgrasp.core.config import read_config, write_config
from mskgrasp.core.errors import BadConfig, BadDataset, UsageError
from mskgrasp.core.files import exclusive_lock, is_leftover, write_whole
from mskgrasp.core.json_text import finite
from mskgrasp.dataset.fingerprint import dataset_fingerprint
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.grasp_models import DESCRIPTION, WEIGHTS, ModelMeta, read_meta, save_model
from mskgrasp.learning.label_source import source_text
from mskgrasp.learning.model_card import model_card
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.samples import Samples, joined_fingerprint, read_samples
from mskgrasp.learning.sides import Sides, split
from mskgrasp.learning.stage import Reporter
from mskgrasp.learning.trainer import train
from mskgrasp.runtime import cli
from mskgrasp.runtime.progress import Bar, advance_to, note, progress
from mskgrasp.train.config import TrainConfig
from mskgrasp.train.figures import draw_curves, draw_uncertainty

CHECKPOINT = "checkpoint.safetensors"
_CHANCE = 0.5
FEW_ATTEMPTS, FEW_PARTS = 1000, 10
"""Data of fewer attempts or parts to train on are warned of."""


class _ProgressBar(Reporter):
    """Progress bar with the loss and the time left; each epoch adds a line and a row of the log.

    The run's settings are stored once it begins: a checkpoint that they do not fit keeps its own.
    """

    def __init__(self, config: TrainConfig, out: Path):
        self._config, self._out = config, out
        self._bar: Bar | None = None
        self._name, self._epochs = "", 0

    def stage(self, name: str, *, epochs: int, batches: int, done: int) -> None:
        self._name, self._epochs = name, epochs
        self.close()
        write_config(self._config, self._out / "config.yaml")
        self._bar = progress(
            title=f"train {name.upper()}", unit="batch", total=epochs * batches, done=done, keep=True
        )

    def batch(self, loss: float) -> None:
        if self._bar is not None:
            self._bar.set_postfix_str(f"loss {loss:.3f}", refresh=False)
            self._bar.update()

    def epoch(self, history: list[EpochMetrics]) -> None:
        last = history[-1]
        _write(self._out / "log.csv", _table(history))
        note(f"{self._name} {last.epoch:3d}/{self._epochs}  {_line(last)}", sys.stdout)

    def close(self) -> None:
        """End the bar."""
        if self._bar is not None:
            self._bar.close()


def _line(one: EpochMetrics) -> str:
    shown = [f"loss {one.train_loss:.3f}", f"validation {one.validation_loss:.3f}"]
    if one.auroc is not None:
        shown.append(f"AUROC {one.auroc:.3f}")
    if one.translation_rmse is not None and one.rotation_rmse is not None:
        shown.append(f"RMSE {one.translation_rmse * 1e3:.2f} mm")
        shown.append(f"{math.degrees(one.rotation_rmse):.2f} deg")
    return "  ".join([*shown, f"{one.seconds:.0f} s"])


def run_training(config: TrainConfig) -> int:
    """Train, and write the model, its metrics, the log and the figures into ``config.out``."""
    if config.epochs is not None:
        shorter = {
            name: stage.model_copy(update={"epochs": config.epochs})
            for name, stage in (("gqn", config.gqn), ("gdn", config.gdn))
        }
        config = config.model_copy(update=shorter | {"epochs": None})
    if config.data is None or config.out is None:
        missing = "--data" if config.data is None else "--out"
        raise UsageError(f"{missing} is needed: python -m mskgrasp.train --data DATASET --out MODEL")
    out = config.out
    _check_out(config, out)
    if (out / DESCRIPTION).exists() and (out / WEIGHTS).exists():
        _check_trained_on([config.data, *config.planned], out)
        (out / CHECKPOINT).unlink(missing_ok=True)
        print(f"{out} is trained already; choose another --out to train again")
        return 0
    device = compute_device(config.device)
    samples = _read(config, config.data)
    sides = split(samples, config)
    print(
        f"{len(sides.training)} attempts to train on, "
        f"{len(samples) - len(sides.training)} at held-out parts; "
        f"{float(samples.success.double().mean()):.0%} succeed; on {device}"
    )
    _warn_of_few(len(sides.training), len(samples.part[sides.training].unique()))
    if samples.skipped:
        skipped = ", ".join(f"{n} ({why})" for why, n in samples.skipped.items())
        print(f"unusable attempts: {skipped}")
    cli.make_folder(out)
    with exclusive_lock(out) as alone:
        if not alone:
            raise UsageError(f"another training is writing into {out}; wait for it, or choose another --out")
        _train_into(out, config, samples, sides, device)
    return 0


def _train_into(out: Path, config: TrainConfig, samples: Samples, sides: Sides, device: torch.device) -> None:
    """Train, and write every file of the run; nobody else writes into the folder."""
    with closing(_ProgressBar(config, out)) as bar:
        models, history = train(
            samples, config, checkpoint_path=out / CHECKPOINT, device=device, reporter=bar, sides=sides
        )
    draw_curves(history, models.meta.metrics, out / "curves.png")
    if config.network.variance:
        rows = sides.test if len(sides.test) else samples.random_of(sides.validation)
        if not bool(samples.success[rows].any()):  # planned grasps alone may succeed
            rows = sides.validation
        draw_uncertainty(models, samples, rows, out / "uncertainty.png")
    _write(out / "metrics.json", json.dumps(finite(models.meta.metrics), indent=2, allow_nan=False) + "\n")
    _write(out / "card.md", model_card(models.meta))
    save_model(out, models)  # last: it says that the training is finished
    (out / CHECKPOINT).unlink(missing_ok=True)
    _summarise(models.meta, out)


def _check_out(config: TrainConfig, out: Path) -> None:
    """Refuse a folder that holds anything but a run of the same settings."""
    if not out.exists() or (out.is_dir() and all(is_leftover(path) for path in out.iterdir())):
        return
    if not (out / "config.yaml").is_file():
        raise UsageError(f"{out} exists and holds no training run; choose another --out")
    here = {"data", "planned", "out", "device"}
    try:
        before = read_config(TrainConfig, out / "config.yaml").model_dump(exclude=here)
    except BadConfig as error:
        raise UsageError(f"{out} holds another program's run ({error}); choose another --out") from error
    now = config.model_dump(exclude=here)
    differing = sorted(key for key in now if now[key] != before[key])
    if differing:
        raise UsageError(
            f"{out} holds a run of other settings ({', '.join(differing)}); choose another --out, or repeat "
            f"its settings (--config {out / 'config.yaml'}) to go on"
        )


def _check_trained_on(data: list[Path], out: Path) -> None:
    """Refuse a folder with a model of other data than these datasets.

    Raises:
        UsageError: It was trained on other grasps.
    """
    known = read_meta(out / DESCRIPTION).training.get("data_fingerprint")
    found = [
        dataset_fingerprint(folder, lambda paths: progress(paths, title="compare data", unit="shard"))
        for folder in data
    ]
    if known not in (None, reduce(joined_fingerprint, found)):
        raise UsageError(
            f"{out} holds a model that was trained on other data than {' and '.join(map(str, data))}; choose "
            "another --out"
        )


def _warn_of_few(n_attempts: int, n_parts: int) -> None:
    if n_attempts < FEW_ATTEMPTS or n_parts < FEW_PARTS:
        note(
            f"warning: {n_attempts} attempts at {n_parts} parts are few to learn from, and the figures will "
            f"say little; collect {FEW_ATTEMPTS} at {FEW_PARTS} parts or more"
        )


def _read(config: TrainConfig, data: Path) -> Samples:
    samples = _read_dataset(config, data)
    kept = samples.of_parts_between(*config.success_range)
    if len(kept.parts) < 2 <= len(samples.parts):
        usable = {samples.parts[number] for number in samples.part.unique().tolist()}
        if len(usable) < 2:
            others = [name for name in samples.parts if name not in usable]
            some = ", ".join(others[:3]) + (", ..." if len(others) > 3 else "")
            raise BadDataset(
                f"only {kept.parts[0]} has usable attempts, and validation needs another part; no attempt at "
                f"{some} is usable ({', '.join(samples.skipped)}): collect more parts"
            )
        low, high = config.success_range
        raise BadDataset(
            f"of the {len(usable)} parts only {kept.parts[0]} has a success in {low:g}..{high:g}, and "
            "validation needs another; widen success_range"
        )
    if any(source.planner for source in samples.sources):
        raise BadDataset(
            f"{data} holds grasps that a planner chose: name it with --planned, random ones with --data"
        )
    for folder in config.planned:
        kept = _with_planned(kept, config, folder)
    return kept


def _with_planned(samples: Samples, config: TrainConfig, folder: Path) -> Samples:
    """Add the planned grasps of a dataset.

    Raises:
        BadDataset: Its grasps are random, or its simulation or settings are others.
    """
    planned = _read_dataset(config, folder)
    if not all(source.planner for source in planned.sources):
        raise BadDataset(f"{folder} holds random grasps: name it with --data, planned ones with --planned")
    if any(source in samples.sources for source in planned.sources):
        raise BadDataset(f"{folder} has planner and seed of another --planned dataset; name each once")
    alike = {"seed": 0, "planner": ""}
    known = [source.model_copy(update=alike) for source in samples.sources]
    for source in planned.sources:
        if source.model_copy(update=alike) not in known:
            raise BadDataset(
                f"{folder} was simulated otherwise than the random grasps: {source_text(source)}, not "
                f"{'; '.join(map(source_text, samples.sources))}; collect both with the same settings"
            )
    joined = samples.joined(planned)
    left = len(samples) + len(planned) - len(joined)
    if left:
        note(f"{left} of {len(planned)} planned attempts are left out: no random one is at their part")
    return joined


def _read_dataset(config: TrainConfig, folder: Path) -> Samples:
    with progress(title=f"read {folder.name}", unit="shard") as bar:
        return read_samples(folder, config.network, advance=partial(advance_to, bar))


def _table(history: list[EpochMetrics]) -> str:
    rows = [one.to_json() for one in history]
    columns = list(dict.fromkeys(key for row in rows for key in row if key != "seconds")) + ["seconds"]
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _write(path: Path, text: str) -> None:
    write_whole(path, text.encode())


def _summarise(meta: ModelMeta, out: Path) -> None:
    report = meta.metrics
    gqn, gdn = (report.get("test", report)[name] for name in ("gqn", "gdn"))
    print(
        f"quality on held-out parts: AUROC {gqn['auroc']:.3f}, "
        f"balanced accuracy {gqn['balanced_accuracy']:.1%}, "
        f"Brier {gqn['brier']:.3f} (always the base rate: {gqn['brier_of_base_rate']:.3f})"
    )
    for name, values in (("network", gdn), *((k, gdn[k]) for k in ("zero_displacement", "training_mean"))):
        print(
            f"displacement, {name.replace('_', ' ')}: {values['translation_rmse'] * 1e3:.2f} mm, "
            f"{math.degrees(values['rotation_rmse']):.2f} deg"
        )
    if gqn["auroc"] <= _CHANCE:
        note(
            "warning: on held-out parts the quality ranks grasps no better than chance; collect more attempts"
        )
    figures = "curves.png, uncertainty.png" if meta.network.variance else "curves.png"
    print(f"wrote {out}: model.safetensors, model.json, card.md, metrics.json, {figures}")
