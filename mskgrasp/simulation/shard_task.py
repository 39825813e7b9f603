"""Description of a shard to make, which needs no simulator."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ShardTask:
    """Attempts to make: `n` of them on a part, from number `first` on.

    Attributes:
        part: The part's name.
        folder: The part's folder.
        index: Number of the shard among those of the part.
        first: Number of the first attempt.
        n: Number of attempts.
        seed: Seed of the run; with the part's name and an attempt's number it determines the attempt.
    """

    part: str
    folder: str
    index: int
    first: int
    n: int
    seed: int
