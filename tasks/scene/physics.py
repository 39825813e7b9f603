"""The engine's configuration for the settings of the simulated cell."""

from __future__ import annotations

from types import SimpleNamespace

from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.utils.structs.types import GPUMemoryConfig, SceneConfig, SimConfig

from mskgrasp.core.settings import Physics

MOST_HULLS = 48
"""Hulls of a part; as `mskgrasp.parts.solids.decompose.MOST_HULLS`, whose module loads the decomposition."""

CONTACTS_A_HULL = 64
"""Contact points that PhysX on a GPU may need room for, a hull: at most table, both pads and palm touch it at
once, a pair has up to 8 points, and pairs that are merely near count, too."""
PATCHES_A_HULL = 16


def gpu_memory(n_hulls: int) -> GPUMemoryConfig:
    """Buffers for PhysX on a GPU, which silently drops contacts if they are too small.

    Args:
        n_hulls: Hulls of all parts of all sub-scenes together.
    """
    usual = GPUMemoryConfig()
    contacts = max(usual.max_rigid_contact_count, _power_of_two(CONTACTS_A_HULL * n_hulls))
    patches = max(usual.max_rigid_patch_count, _power_of_two(PATCHES_A_HULL * n_hulls))
    # The stack holds the points of a pair before they are written out: 128 bytes a point.
    stack = max(usual.collision_stack_size, 128 * contacts)
    return GPUMemoryConfig(
        max_rigid_contact_count=contacts, max_rigid_patch_count=patches, collision_stack_size=stack
    )


def _power_of_two(count: int) -> int:
    return 1 << max(0, count - 1).bit_length()


def _control_freq(rate_hz: int) -> int:
    """20 Hz, as in ManiSkill's own tasks, or the next lower frequency that divides the rate."""
    return next(hz for hz in range(20, 0, -1) if rate_hz % hz == 0)


def set_engine(physics: Physics) -> None:
    """Apply the task's engine settings, for scenes without the task."""
    # ManiSkill does this for its own scenes, from the configuration alone.
    config = SimpleNamespace(sim_config=sim_config(physics, MOST_HULLS))
    BaseEnv._set_scene_config(config)  # type: ignore[arg-type]


def sim_config(physics: Physics, n_hulls: int) -> SimConfig:
    """ManiSkill's configuration for these settings, and for so many hulls in all sub-scenes together."""
    return SimConfig(
        spacing=2.0,  # far sub-scenes lose float32 precision; parts and arms need under 2 m
        sim_freq=physics.rate_hz,
        control_freq=_control_freq(physics.rate_hz),
        gpu_memory_config=gpu_memory(n_hulls),
        scene_config=SceneConfig(
            contact_offset=physics.contact_offset,
            rest_offset=0.0,
            sleep_threshold=0.0,  # a sleeping part ignores a slow push
            solver_position_iterations=physics.position_iterations,
            enable_pcm=physics.persistent_manifold,
            cpu_workers=0,
        ),
    )
