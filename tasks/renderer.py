"""Which device draws the depth images, and what to do where none can."""

from __future__ import annotations

from functools import cache

import sapien

from mskgrasp.errors import MskgraspError


class NoRenderer(MskgraspError):
    """No usable Vulkan driver."""


@cache
def render_backend() -> str:
    """ManiSkill's name of the device to render on: a CUDA GPU where there is one, else any Vulkan CPU device.

    Raises:
        NoRenderer: Neither is there; the message names the package to install.
    """
    problems = []
    for backend, device in (("sapien_cuda", "cuda"), ("cpu", "cpu")):
        try:
            sapien.render.RenderSystem(sapien.Device(device))
        except RuntimeError as error:
            problems.append(str(error).splitlines()[0])
        else:
            return backend
    raise NoRenderer(
        f"no usable Vulkan driver ({problems[-1]}); install your GPU's driver, or Mesa 24.3 or newer: on "
        "Debian 12 enable bookworm-backports, then run: apt-get install -t bookworm-backports "
        "mesa-vulkan-drivers"
    )
