"""Attempts of one part in a dataset, without their images, and a filter of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import quat_conjugate, quat_rotate
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset import Dataset, ShardInfo, read_columns, read_shard, u16_to_depth
from mskgrasp.parts import Part

COLUMNS = (
    "grasp", "success", "failure", "displacement", "tilt", "pose_base_obj", "pose_tcp_obj_after", "attempt",
    "draw",
)  # fmt: skip
ALL, LIFTED = "all", "lifted"


@dataclass(frozen=True, kw_only=True)
class AttemptList:
    """n attempts at one part.

    Attributes:
        columns: Arrays (n, ...) by name, as in `mskgrasp.dataset.Attempts`.
        shard: (n,) index of each attempt's shard.
        row: (n,) its row there.
        paths: Files of the shards.
        infos: What the attempts of a shard share.
    """

    columns: dict[str, np.ndarray]
    shard: np.ndarray
    row: np.ndarray
    paths: tuple[Path, ...]
    infos: tuple[ShardInfo, ...]

    @classmethod
    def of(cls, dataset: Dataset, part: str) -> AttemptList:
        """Read the attempts at a part.

        Raises:
            UsageError: The dataset has none.
            BadDataset: A shard is damaged.
        """
        paths = tuple(path for path in dataset.paths if path.stem.rpartition("-")[0] == part)
        if not paths:
            raise UsageError(
                f"{dataset.folder} has no attempts at part '{part}'; it has {len(dataset.part_names)} parts, "
                f"for example {', '.join(dataset.part_names[:3])}"
            )
        read = [read_columns(path, COLUMNS) for path in paths]
        lengths = [len(arrays["grasp"]) for arrays, _ in read]
        return cls(
            columns={name: np.concatenate([arrays[name] for arrays, _ in read]) for name in COLUMNS},
            shard=np.repeat(np.arange(len(paths)), lengths),
            row=np.concatenate([np.arange(length) for length in lengths]),
            paths=paths,
            infos=tuple(info for _, info in read),
        )

    def __len__(self) -> int:
        return len(self.row)

    def info(self, number: int) -> ShardInfo:
        """What an attempt shares with others of its shard."""
        return self.infos[int(self.shard[number])]

    def depth(self, number: int) -> np.ndarray:
        """(h, w) depth image of an attempt, metres, NaN where invalid.

        Raises:
            BadDataset: The shard is damaged.
        """
        attempts, _ = read_shard(self.paths[int(self.shard[number])])
        return u16_to_depth(attempts.depth[int(self.row[number])])

    def outcomes(self) -> list[str]:
        """Outcomes that occur, for a choice: all, lifted, and the names of failures."""
        failures = np.unique(self.columns["failure"][~self.columns["success"]])
        return [ALL, LIFTED, *(FAILURES[code] for code in failures)]

    def chosen(
        self,
        outcome: str = ALL,
        resting: np.ndarray | None = None,
        which: int | None = None,
        shift: tuple[float, float] = (0.0, np.inf),
    ) -> np.ndarray:
        """Indices of the attempts that pass a filter.

        Args:
            outcome: One of `outcomes`.
            resting: (n,) resting pose of each attempt, by `resting_poses`; None: not known.
            which: The resting pose; None: all.
            shift: Bounds of the distance by which a lifted part's origin moved in the hand, metres; the
                others have none, and pass.
        """
        success = self.columns["success"]
        passes = np.ones(len(self), dtype=bool)
        if outcome == LIFTED:
            passes &= success
        elif outcome != ALL:
            passes &= ~success & (self.columns["failure"] == FAILURES.index(outcome))
        if which is not None and resting is not None:
            passes &= resting == which
        moved = np.linalg.norm(self.columns["displacement"][:, :3], axis=1)
        passes &= ~success | ((moved >= shift[0]) & (moved <= shift[1]))
        return np.flatnonzero(passes)


def resting_poses(quats_wxyz: np.ndarray, part: Part) -> np.ndarray:
    """Indices (n,) of the resting poses in which a part lay, whatever its turn about the vertical.

    Args:
        quats_wxyz: (n, 4) orientations of the part in the base.
        part: The part.
    """
    up = np.array([0.0, 0.0, 1.0])
    lying = quat_rotate(quat_conjugate(np.asarray(quats_wxyz, np.float64)), up)
    known = quat_rotate(quat_conjugate(part.resting.quat_wxyz), up)
    return np.argmax(lying @ known.T, axis=1)
