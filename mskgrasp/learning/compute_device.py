"""The device that networks are computed on."""

from __future__ import annotations

import torch

from mskgrasp.core.errors import UsageError
from mskgrasp.learning.config import DeviceName


def compute_device(name: DeviceName = "auto") -> torch.device:
    """Choose the device of networks, and set cuDNN up for it, in the whole process.

    The same seed then gives the same weights on the same GPU. A GPU computes convolutions in float32 then:
    in TF32, torch's default, predictions differ from a CPU's by micrometres.

    Args:
        name: auto: the first CUDA device where there is one, else the CPU.

    Raises:
        UsageError: There is no CUDA device, but one is asked for.
    """
    available = torch.cuda.is_available()
    if name == "cuda" and not available:
        raise UsageError("--device cuda: no CUDA device is available; legal here: auto, cpu")
    if name == "cpu" or not available:
        return torch.device("cpu")
    torch.backends.cudnn.deterministic = True
    torch.backends.cudnn.allow_tf32 = False
    return torch.device("cuda", 0)
