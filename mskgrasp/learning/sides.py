"""Parts to train on, to select by, and to measure on."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import torch
from torch import Tensor

from mskgrasp.core.errors import BadDataset
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.samples import Samples, part_sides
from mskgrasp.parts.catalogue import SPLITS, read_index, splits_of
from mskgrasp.runtime.progress import note


@dataclass(frozen=True, kw_only=True)
class Sides:
    """Rows of the samples by side; no part is on two sides.

    Attributes:
        training: Rows to train on.
        validation: Rows that select the epoch and calibrate.
        test: Rows of random grasps at families that training never sees, for the final metrics only. Empty if
            parts are split by name, or if none of them is ever lifted: no displacement can be measured on
            those.
        new_sizes: The same for other sizes of families that training sees.
    """

    training: Tensor
    validation: Tensor
    test: Tensor
    new_sizes: Tensor

    @property
    def digest(self) -> str:
        """Hex digest of the rows to train on and to select by: others make another model."""
        rows = torch.cat([torch.tensor([len(self.training)]), self.training, self.validation])
        return hashlib.sha256(rows.numpy().tobytes()).hexdigest()


def split(samples: Samples, config: LearningConfig) -> Sides:
    """Split the samples by their parts.

    Raises:
        BadDataset: Training or validation lacks successes or failures.
    """
    sides = part_sides(samples.parts, config.validation_fraction, config.sides)
    if config.sides == "catalogue":
        _note_missing(samples.parts)
    rows = [
        torch.nonzero(torch.isin(samples.part, torch.tensor(numbers, dtype=torch.int64)))[:, 0]
        for numbers in (
            [number for number, name in enumerate(samples.parts) if sides[name] == side] for side in SPLITS
        )
    ]
    for name, side in zip(("training", "validation"), rows, strict=False):
        n, n_success = len(side), int(samples.success[side].sum())
        if n_success in (0, n):
            kind = "success" if n_success == 0 else "failure"
            raise BadDataset(f"no {kind} among the {n} attempts at the {name} parts; collect more attempts")
    for k, name in ((2, "test"), (3, "new_sizes")):
        rows[k] = rows[k][~samples.planned[rows[k]]]
        if len(rows[k]) and not samples.success[rows[k]].any():
            note(f"warning: no success among the {len(rows[k])} attempts at the {name} parts; left out")
            rows[k] = rows[k][:0]
    return Sides(training=rows[0], validation=rows[1], test=rows[2], new_sizes=rows[3])


def _note_missing(parts: tuple[str, ...]) -> None:
    """Report the parts whose side the catalogue of this machine does not decide alone."""
    index = read_index()
    known = splits_of(parts, index)
    for names, fate in (
        ([name for name in parts if name in known and name not in index.parts], "their families"),
        ([name for name in parts if name not in known], "their names"),
    ):
        if names:
            some = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
            note(
                f"{len(names)} of {len(parts)} parts are not in the catalogue of this machine ({some}): "
                f"{fate} decide on which side they are"
            )
