"""The engine's configuration for the settings of the simulated cell."""

from __future__ import annotations

from mani_skill.utils.structs.types import GPUMemoryConfig, SceneConfig, SimConfig

from mskgrasp.settings import Physics


def sim_config(physics: Physics) -> SimConfig:
    """ManiSkill's configuration for these settings."""
    return SimConfig(
        spacing=2.0,  # far sub-scenes lose float32 precision; parts and arms need under 2 m
        sim_freq=physics.rate_hz,
        control_freq=physics.rate_hz // 25,
        gpu_memory_config=GPUMemoryConfig(
            max_rigid_contact_count=2**21, max_rigid_patch_count=2**20, collision_stack_size=2**28
        ),
        scene_config=SceneConfig(
            contact_offset=physics.contact_offset,
            rest_offset=0.0,
            sleep_threshold=0.0,  # a sleeping part ignores a slow push
            solver_position_iterations=physics.position_iterations,
            enable_pcm=physics.persistent_manifold,
            cpu_workers=0,
        ),
    )
