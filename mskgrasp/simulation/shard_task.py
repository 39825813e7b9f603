"""Description of a shard to make, which needs no simulator."""

from __future__ import annotations

from dataclasses import dataclass

from mskgrasp.core.errors import UsageError
from mskgrasp.dataset.labels import ShardLabels


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

    def check_labels(self, labels: ShardLabels) -> None:
        """Refuse labels of other attempts.

        Raises:
            UsageError: They are not those of this shard.
        """
        numbers = labels.columns["attempt"]
        within = ((self.first <= numbers) & (numbers < self.first + self.n)).all()
        made = len(numbers) + sum(labels.info.discarded.values())
        if not within or made != self.n or labels.info.seed != self.seed:
            raise UsageError(
                f"the labels of shard {self.index} of part '{self.part}' are not those of attempts "
                f"{self.first} to {self.first + self.n - 1} of seed {self.seed}: use the settings they were "
                "made with"
            )
