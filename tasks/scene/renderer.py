"""Choice of the device that renders depth images."""

from __future__ import annotations

from functools import cache

import sapien

from mskgrasp.core.errors import MskgraspError


class NoRenderer(MskgraspError):
    """No usable Vulkan driver."""


@cache
def render_backend() -> str:
    """ManiSkill's name of the device to render on: a CUDA GPU where there is one, else any Vulkan CPU device.

    Raises:
        NoRenderer: Neither exists; the message names the package to install.
    """
    problem = ""
    sapien.render.set_log_level("off")  # one line of ours in place of three of Vulkan
    try:
        for backend, device in (("sapien_cuda", "cuda"), ("cpu", "cpu")):
            try:
                sapien.render.RenderSystem(sapien.Device(device))
            except RuntimeError as error:
                problem = str(error).splitlines()[0]
            else:
                return backend
    finally:
        sapien.render.set_log_level("warn")
    raise NoRenderer(
        f"no usable Vulkan driver ({problem}); install your GPU's driver, or Mesa 24.3 or newer. On "
        "Debian 12, as root: echo 'deb http://deb.debian.org/debian bookworm-backports main' > "
        "/etc/apt/sources.list.d/bookworm-backports.list && apt-get update && apt-get install -y "
        "-t bookworm-backports mesa-vulkan-drivers libvulkan1"
    )
