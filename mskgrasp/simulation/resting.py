"""Which resting poses of a part stand in the engine, kept in the cache folder."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.core.files import write_whole
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part
from mskgrasp.parts.store import parts_folder
from mskgrasp.runtime.progress import progress
from mskgrasp.simulation.versions import versions


@dataclass(frozen=True, kw_only=True)
class Resting:
    """Resting poses of a part, in the order of ``part.json``.

    Attributes:
        stands: Of each pose, whether the engine holds it.
        probability: Of each pose.
    """

    stands: tuple[bool, ...]
    probability: tuple[float, ...]

    @property
    def toppled(self) -> float:
        """Probability of the poses that topple, which attempts leave out."""
        left_out = (share for share, stands in zip(self.probability, self.stands, strict=True) if not stands)
        return sum(left_out) / sum(self.probability)


def resting_of(part: Part, physics: Physics | None = None) -> Resting:
    """Which resting poses stand: from the cache, or settled in the engine, which takes some seconds to load.

    Needs no renderer. A cache that cannot be written is not used.

    Args:
        part: Any part; its content hash is the key.
        physics: Settings of the engine; None: those of production.
    """
    physics = physics or Physics()
    path = _cached(part, physics)
    stands = _read(path, len(part.resting_probability))
    if stands is None:
        stands = _settle(part, physics)
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, (json.dumps(dict(part=part.name, stands=stands)) + "\n").encode())
    return Resting(stands=tuple(stands), probability=tuple(map(float, part.resting_probability)))


def _settle(part: Part, physics: Physics) -> list[bool]:
    # The engine takes seconds to load; a part that was settled before does not need it.
    from tasks.scene.physics import set_engine
    from tasks.scene.standing import settled_poses

    set_engine(physics)
    found: Iterable = progress(
        settled_poses(part, physics), unit="pose", total=len(part.resting_probability), title="settle"
    )
    return [pose is not None for pose in found]


def _cached(part: Part, physics: Physics) -> Path:
    known = versions()
    key = json.dumps([known["simulation"], known["sapien"], physics.model_dump(mode="json")], sort_keys=True)
    digest = hashlib.sha256((part.content_hash + key).encode()).hexdigest()
    return parts_folder().with_name("resting") / f"{digest[:32]}.json"


def _read(path: Path, n_poses: int) -> list[bool] | None:
    """What is stored; None where there is nothing, or nothing that can be used."""
    try:
        stands = json.loads(path.read_text(encoding="utf-8"))["stands"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    usable = (
        isinstance(stands, list) and len(stands) == n_poses and all(isinstance(one, bool) for one in stands)
    )
    return stands if usable else None
