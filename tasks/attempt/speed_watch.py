"""Greatest speeds of the parts in an attempt."""

from __future__ import annotations

import math

from mani_skill.utils.structs.actor import Actor

from mskgrasp.core.geometry import Array
from tasks.scene.arrays import Arrays


class SpeedWatch:
    """Greatest speed of each sub-scene's part since `start`, from positions a few steps apart.

    Args:
        part: The part of each of n sub-scenes.
        arrays: Kind of array of the speeds.
    """

    def __init__(self, part: Actor, arrays: Arrays):
        self._part = part
        self._arrays = arrays
        self._entity = None if part.scene.gpu_sim_enabled else part._objs[0]
        self.start(0.0)

    def start(self, seconds: float) -> None:
        """Reset the speeds; ``seconds`` is the simulated time."""
        self._last, self._seconds = self._position(), seconds
        self._fastest: Array = 0.0 if self._entity else self._arrays.full(len(self._last), 0.0)

    def update(self, seconds: float) -> None:
        """Compare the poses with the last ones."""
        now, passed = self._position(), seconds - self._seconds
        self._seconds, last, self._last = seconds, self._last, now
        if passed <= 0:
            return
        if self._entity is None:
            speed = (now - last).norm(dim=-1) / passed
            self._fastest = self._arrays.xp.maximum(speed, self._fastest)
        else:
            self._fastest = max(self._fastest, math.dist(now, last) / passed)

    def fastest(self) -> Array:
        """(n,) m/s, float32."""
        return self._arrays.full(1, self._fastest) if self._entity else self._fastest

    def _position(self) -> Array:
        # One sub-scene: plain numbers, as there are forty updates an attempt.
        return self._part.pose.p.clone() if self._entity is None else self._entity.pose.p.tolist()
