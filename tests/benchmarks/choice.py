"""A choice of networks and training, what it sees of a dataset, and what it predicts."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from mskgrasp.core.files import write_whole
from mskgrasp.core.predicted_intervals import IntervalTable, normal_half_width
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models
from mskgrasp.learning.network_config import NetworkConfig
from mskgrasp.learning.samples import Samples, read_samples
from mskgrasp.learning.sides import Sides
from mskgrasp.runtime.progress import advance_to, progress


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A way to train.

    Attributes:
        name: In tables.
        config: Settings; the seed is replaced.
        quality_of: Name of an earlier choice, whose quality network is used; empty: trained by this one.
        build: Builds networks of which the displacement network alone is trained, for networks that do not
            ship; None: both networks are trained as `mskgrasp.train` does.
        samples: What this choice sees of the samples.
        sides: The attempts that it trains on.
        most_seeds: Greatest number of its trainings; None: as many as of the others.
    """

    name: str
    config: LearningConfig
    quality_of: str = ""
    build: Callable[[ModelMeta], Models] | None = None
    samples: Callable[[Samples], Samples] = field(default=lambda samples: samples)
    sides: Callable[[Samples, Sides], Sides] = field(default=lambda samples, sides: sides)
    most_seeds: int | None = None

    @property
    def has_quality(self) -> bool:
        """Whether it trains a quality network."""
        return self.build is None and not self.quality_of

    def seeds(self, n: int) -> range:
        """Seeds of its trainings where the others have n."""
        return range(n if self.most_seeds is None else min(n, self.most_seeds))

    def stages(self) -> tuple[str, ...]:
        """Names of the networks that it trains."""
        return ("gqn", "gdn") if self.has_quality else ("gdn",)

    def folder(self, out: Path, seed: int) -> Path:
        """Folder of the training with a seed."""
        return out / re.sub(r"[^a-z0-9]+", "_", self.name.lower()).strip("_") / f"seed_{seed}"


@dataclass(frozen=True, kw_only=True)
class Predictions:
    """What trained networks predict for a group of n attempts, m of them successful.

    Attributes:
        quality: (n,) probabilities of success; empty without a quality network.
        mean: (m, k) grasp displacement, metres and radians.
        variance: (m, k), NaN where none is predicted.
        intervals: `IntervalTable` as JSON; empty: those of normal distributions.
    """

    quality: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    intervals: np.ndarray = field(default_factory=lambda: np.array(""))

    def half_width(self, level: float, variance: np.ndarray) -> float | np.ndarray:
        """Half widths of the central interval of a probability, in predicted standard deviations."""
        if text := str(self.intervals):
            return IntervalTable.model_validate_json(text).half_width(level, variance)
        return normal_half_width(level)

    def write(self, path: Path) -> None:
        """Store them atomically."""
        content = io.BytesIO()
        np.savez(content, **{name: getattr(self, name) for name in self.__annotations__})
        write_whole(path, content.getvalue())

    @classmethod
    def read(cls, path: Path) -> Predictions:
        """Read stored predictions."""
        with np.load(path, allow_pickle=False) as stored:
            return cls(**{name: stored[name] for name in cls.__annotations__})

    def only(self, kept: np.ndarray, success: np.ndarray) -> Predictions:
        """Those for some of the n attempts: both masks (n,)."""
        held = kept[success]
        quality = self.quality[kept] if len(self.quality) else self.quality
        return replace(self, quality=quality, mean=self.mean[held], variance=self.variance[held])

    def __add__(self, other: Predictions) -> Predictions:
        """Both, one after the other."""
        both = ("quality", "mean", "variance")
        return replace(
            self, **{name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in both}
        )


class Looks:
    """The samples of a dataset as each network sees them, read when they are first asked for.

    All have the same rows: which attempts are used depends on no network.
    """

    def __init__(self, data: Path, success_range: tuple[float, float]):
        """Remember what to read.

        Args:
            data: Dataset folder.
            success_range: Parts with another success rate of random grasps are left out.
        """
        self.data, self.success_range = data, success_range
        self._known: dict[tuple[int, int, float, bool], Samples] = {}

    def of(self, network: NetworkConfig) -> Samples:
        """Read the samples that a network is trained on."""
        look = (*network.patch_shape, network.patch_side)
        for sees_object in (network.sees_object, True):  # patches around parts come with those around grasps
            known = self._known.get((*look, sees_object))
            if known is not None:
                return known if network.sees_object else replace(known, object_patches=None)
        with progress(title="read shards", unit="shard") as bar:
            found = read_samples(self.data, network, advance=partial(advance_to, bar))
        self._known[*look, network.sees_object] = found.of_parts_between(*self.success_range)
        return self._known[*look, network.sees_object]
