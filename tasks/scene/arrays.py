"""Arrays of the kind that a simulation computes with: numpy or torch.

On the CPU, where there is one sub-scene, PhysX hands out numpy arrays, and an operation on so few numbers
takes numpy a third of the time that it takes torch. On a GPU everything is a tensor. Code written with
`Arrays` and the operators common to both runs on either.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

import numpy as np
import torch
from array_api_compat import array_namespace
from mani_skill.envs.scene import ManiSkillScene

from mskgrasp.core.geometry import Array


@dataclass(frozen=True)
class Arrays:
    """Factory of arrays of one kind, numpy or torch.

    Attributes:
        device: Device of tensors; None for numpy arrays.
    """

    device: torch.device | None

    @cached_property
    def xp(self) -> ModuleType:
        """The functions for this kind, by the names of the array API standard."""
        return array_namespace(self.of(()))

    def of(self, values: Array) -> Array:
        """An array or a tensor as an array of this kind, of the same type; without a copy where it can."""
        if self.device is None:
            return np.asarray(values)
        return torch.as_tensor(values, device=self.device)

    def numpy(self, values: Array) -> np.ndarray:
        """An array of this kind in numpy, in double precision."""
        return np.asarray(values if self.device is None else values.cpu(), dtype=np.float64)

    def full(self, n: int, value: float | bool) -> Array:
        """(n,) of one value: bool, or float32."""
        kind = np.bool_ if isinstance(value, (bool, np.bool_)) else np.float32
        return self.of(np.full(n, value, kind))


def arrays_for(scene: ManiSkillScene) -> Arrays:
    """The kind of a scene's simulation."""
    return Arrays(scene.device if scene.gpu_sim_enabled else None)
