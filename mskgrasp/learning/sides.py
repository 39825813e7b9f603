"""Parts to train on, to select by, and to measure on."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from mskgrasp.core.errors import BadDataset
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.samples import Samples
from mskgrasp.parts.catalogue import read_index, splits_of
from mskgrasp.parts.names import SPLITS, Split
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


def part_sides(parts: tuple[str, ...], fraction: float, by: Literal["name", "catalogue"]) -> dict[str, Split]:
    """Assign each part to a side of the split.

    Training and validation get one at least: where one of them would be empty, it takes a part of training,
    or one that the name puts on validation; never a part that the catalogue holds out. A part keeps its side
    when other parts join the dataset, unless it was taken so.

    Args:
        parts: Names.
        fraction: Share of validation parts, for a split by name.
        by: name: a hash of the part's name; catalogue: the catalogue's split, which holds out whole families,
            those of parts that are not built on this machine, too, and the name for parts without a recipe.

    Raises:
        BadDataset: There are fewer than two parts, no catalogue, or no part that training or validation can
            take.
    """
    if len(parts) < 2:
        raise BadDataset(
            f"the dataset has one part ({', '.join(parts)}), validation needs another that training never "
            "sees; collect at least 2 parts"
        )
    sides: dict[str, Split] = {
        name: "validation" if _name_hash(name) < fraction else "train" for name in parts
    }
    of_catalogue: dict[str, Split] = {}
    if by == "catalogue":
        index = read_index()
        if not index.parts:
            raise BadDataset(
                "sides: catalogue needs the catalogue: python -m mskgrasp.parts build --catalogue"
            )
        of_catalogue = splits_of(parts, index)
        sides |= of_catalogue
    order = sorted(parts, key=_name_hash)
    needed: dict[Split, list[str]] = {"validation": order, "train": order[::-1]}
    for side, candidates in needed.items():
        count = Counter(sides.values())
        if not count[side]:
            spare = [name for name in candidates if _is_spare(sides[name], count, name in of_catalogue)]
            if not spare:
                found = ", ".join(f"{count[one]} {one}" for one in SPLITS if count[one])
                raise BadDataset(
                    f"no part is left for {side} (by the catalogue: {found}); "
                    f"collect parts of --parts {side}, too"
                )
            sides[spare[0]] = side
    return sides


def _is_spare(side: Split, count: Mapping[Split, int], in_catalogue: bool) -> bool:
    """Whether a part of a side can be given to training or validation, of which one has none."""
    return count[side] > 1 and (side == "train" or (side == "validation" and not in_catalogue))


def _name_hash(name: str) -> float:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64


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
