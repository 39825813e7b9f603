"""Made-up outcomes of grasps."""

from __future__ import annotations

import dataclasses

import numpy as np

from mskgrasp.validate.outcomes import Outcomes

PARTS = 20


def outcomes(per_part: int = 10, **changes: np.ndarray) -> Outcomes:
    """Half succeed, displacements of some millimetres."""
    rng = np.random.default_rng(5)
    n = PARTS * per_part
    success = np.arange(n) % 2 == 0
    displacement = np.where(success[:, None], rng.normal(0, 0.004, (n, 4)), np.nan)
    plain = Outcomes(
        success=success, failure=(~success).astype(int), settled=np.ones(n, bool), displacement=displacement,
        tilt=np.zeros(n), penetration=np.zeros(n), fastest=np.full(n, 0.3), seconds=np.ones(n),
        cpu_seconds=np.full(n, 0.1), part=np.repeat([f"part-{k:02d}" for k in range(PARTS)], per_part),
        index=np.tile(np.arange(per_part), PARTS),
    )  # fmt: skip
    return dataclasses.replace(plain, **changes)


def moved(before: Outcomes, by: float | np.ndarray) -> Outcomes:
    """The same with other displacements."""
    return dataclasses.replace(before, displacement=before.displacement + by)
