"""How fast the parts become in an attempt."""

from __future__ import annotations

from typing import Any

import torch
from mani_skill.utils.structs.actor import Actor
from torch import Tensor


class SpeedWatch:
    """Greatest speed of each sub-scene's part since `start`, from positions a few steps apart.

    Args:
        part: The part of each of n sub-scenes.
        gpu: Whether PhysX runs on a GPU.
    """

    def __init__(self, part: Actor, *, gpu: bool):
        self._part = part
        self._entity = None if gpu else part._objs[0]
        self.start(0.0)

    def start(self, seconds: float) -> None:
        """Forgets what was seen; ``seconds`` is the simulated time."""
        self._last, self._seconds = self._position(), seconds
        self._fastest: float | Tensor = 0.0

    def look(self, seconds: float) -> None:
        """Compares with the look before."""
        now, passed = self._position(), seconds - self._seconds
        self._seconds, last, self._last = seconds, self._last, now
        if passed <= 0:
            return
        if isinstance(now, Tensor):
            speed = (now - last).norm(dim=-1) / passed
            self._fastest = torch.maximum(speed, torch.as_tensor(self._fastest, device=speed.device))
        else:
            x, y, z = now - last
            self._fastest = max(float(self._fastest), (x * x + y * y + z * z) ** 0.5 / passed)

    def fastest(self, like: Tensor) -> Tensor:
        """(n,) m/s, of the type and on the device of another tensor."""
        return torch.as_tensor(self._fastest, dtype=like.dtype, device=like.device).expand(like.shape)

    def _position(self) -> Any:
        # One sub-scene: asking the engine costs a hundredth of a tensor operation.
        return self._part.pose.p.clone() if self._entity is None else self._entity.pose.p
