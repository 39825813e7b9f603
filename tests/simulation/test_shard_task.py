"""Description of a shard: it travels without a simulator."""

from __future__ import annotations

import copy
import multiprocessing
import subprocess
import sys

from mskgrasp.simulation.shard_task import ShardTask

TASK = ShardTask(part="nut", folder="/parts/nut", index=2, first=200, n=100, seed=7)


def test_a_task_is_the_same_after_a_journey_to_another_process_and_counts_as_a_key():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        again = pool.apply(copy.copy, (TASK,))
    assert again == TASK and {TASK: 1}[again] == 1
    assert ShardTask(**{**vars(TASK), "first": 201}) != TASK


def test_planning_shards_loads_neither_the_simulator_nor_torch():
    """Planning must not cost seconds, and a cluster's head need not have a simulator."""
    program = (
        "import sys, mskgrasp.simulation.shard_task\n"
        "assert not {'sapien', 'mani_skill', 'torch', 'gymnasium'} & sys.modules.keys()"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
