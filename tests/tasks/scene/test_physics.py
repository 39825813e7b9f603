"""The engine's configuration; on a GPU, buffers that are too small lose contacts without a word."""

from __future__ import annotations

import gymnasium
import pytest
from mani_skill.utils.structs.types import GPUMemoryConfig
from sapien.physx import PhysxRigidDynamicComponent, get_scene_config

from mskgrasp.core.settings import Physics
from mskgrasp.parts.solids import decompose
from tasks.scene.physics import CONTACTS_A_HULL, MOST_HULLS, PATCHES_A_HULL, gpu_memory, sim_config


def test_buffers_grow_with_the_hulls_and_are_never_smaller_than_usual():
    few, many = gpu_memory(1), gpu_memory(4096 * MOST_HULLS)
    usual = GPUMemoryConfig()
    assert few.max_rigid_contact_count == usual.max_rigid_contact_count
    assert many.max_rigid_contact_count >= CONTACTS_A_HULL * 4096 * MOST_HULLS
    assert many.max_rigid_patch_count >= PATCHES_A_HULL * 4096 * MOST_HULLS
    assert many.collision_stack_size > usual.collision_stack_size


def test_the_most_hulls_are_those_of_the_decomposition():
    assert MOST_HULLS == decompose.MOST_HULLS


def test_no_buffer_shrinks_as_hulls_are_added_and_all_are_powers_of_two():
    """A GPU's buffers grow by doubling; a point of the stack takes 128 bytes."""
    sizes = [gpu_memory(n) for n in (1, 100, 1000, 5000, 20_000, 100_000)]
    for name in ("max_rigid_contact_count", "max_rigid_patch_count", "collision_stack_size"):
        values = [getattr(one, name) for one in sizes]
        assert values == sorted(values) and values[-1] > values[0], name
    for one in sizes[-2:]:
        assert one.max_rigid_contact_count.bit_count() == one.max_rigid_patch_count.bit_count() == 1
        assert one.collision_stack_size >= 128 * one.max_rigid_contact_count
    # 64 * 100 000 points are under 2^23.
    assert sizes[-1].max_rigid_contact_count == 2**23 and sizes[-1].max_rigid_patch_count == 2**21


@pytest.mark.parametrize(
    ("rate_hz", "control_hz"), [(1000, 20), (500, 20), (250, 10), (240, 20), (2000, 20), (330, 15), (127, 1)]
)
def test_a_control_step_is_a_whole_number_of_simulation_steps(rate_hz: int, control_hz: int):
    """ManiSkill's 20 Hz, or the next frequency below it that divides the rate."""
    config = sim_config(Physics(rate_hz=rate_hz, coarse_rate_hz=min(rate_hz, 250)), 1)
    assert (config.sim_freq, config.control_freq) == (rate_hz, control_hz)


def test_the_scene_that_physx_runs_has_the_settings(boxes):
    """Read back from the engine: what ManiSkill does not pass on would be lost without a word."""
    made = gymnasium.make(
        "GraspDisplacement-v1", parts=[str(boxes["light"].folder)], obs_mode="none", render_backend="none",
        physics=dict(rate_hz=500, position_iterations=37, contact_offset=0.003, persistent_manifold=True),
    )  # fmt: skip
    try:
        env = made.unwrapped
        env.reset(seed=0)
        assert env.scene.timestep == pytest.approx(1 / 500)
        body = env.part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
        assert body.solver_position_iterations == 37 and body.sleep_threshold == 0
        for shape in body.collision_shapes:
            assert (shape.contact_offset, shape.rest_offset) == pytest.approx((0.003, 0))
        assert get_scene_config().enable_pcm is True
        assert get_scene_config().gravity == pytest.approx([0, 0, -9.81])
    finally:
        made.close()
