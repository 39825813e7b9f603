"""Buffers of PhysX on a GPU hold what the parts may need: too small ones lose contacts without a word."""

from __future__ import annotations

from mani_skill.utils.structs.types import GPUMemoryConfig

from mskgrasp.parts.solids import decompose
from tasks.scene.physics import CONTACTS_A_HULL, MOST_HULLS, PATCHES_A_HULL, gpu_memory


def test_buffers_grow_with_the_hulls_and_are_never_smaller_than_usual():
    few, many = gpu_memory(1), gpu_memory(4096 * MOST_HULLS)
    usual = GPUMemoryConfig()
    assert few.max_rigid_contact_count == usual.max_rigid_contact_count
    assert many.max_rigid_contact_count >= CONTACTS_A_HULL * 4096 * MOST_HULLS
    assert many.max_rigid_patch_count >= PATCHES_A_HULL * 4096 * MOST_HULLS
    assert many.collision_stack_size > usual.collision_stack_size


def test_the_most_hulls_are_those_of_the_decomposition():
    assert MOST_HULLS == decompose.MOST_HULLS
