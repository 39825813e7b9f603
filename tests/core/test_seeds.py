"""Seeds of scenes: fixed by what datasets and runs were made with, and different for every scene."""

from __future__ import annotations

import itertools
from functools import partial

import numpy as np

from mskgrasp.core.geometry import Pose
from mskgrasp.core.seeds import scene_seeds, trial_seeds
from mskgrasp.parts.resting_pose import random_resting_pose

spread_trial_seeds = partial(trial_seeds, spread=True)


def test_the_seeds_are_those_that_datasets_were_made_with():
    assert scene_seeds(0, "hex_nut_m30", 0) == (1936012876, 1649974050)
    assert scene_seeds(3, "washer_m36", 41) == (176129170, 1375270067)


def test_seed_part_and_number_all_make_another_scene():
    for seeds in (scene_seeds, trial_seeds, spread_trial_seeds):
        scenes = {seeds(seed, part, number) for seed in (0, 1) for part in "ab" for number in (0, 1)}
        assert len(scenes) == 8


def test_no_trial_has_a_scene_of_a_dataset():
    of_data = {
        scene_seeds(seed, "a", number, draw)[0]
        for seed, number, draw in itertools.product(range(3), range(200), range(5))
    }
    assert len(of_data) == 3000
    assert not of_data & {trial_seeds(seed, "a", number)[0] for seed in range(3) for number in range(200)}
    assert not of_data & {spread_trial_seeds(seed, "a", n)[0] for seed in range(3) for n in range(50)}


def test_spread_trials_see_resting_poses_as_often_as_they_are_probable():
    probability = np.array([0.45, 0.3, 0.15, 0.1])
    poses = Pose(position=np.zeros((4, 3)), quat_wxyz=np.eye(4)[[0] * 4])
    poses.position[:, 2] = np.arange(1, 5)  # the pose is known by its height
    corners = np.zeros((8, 3))
    region = (0.4, 0.5, -0.1, 0.1)

    def counts(seeds_of, run: int, n: int) -> np.ndarray:
        drawn = [
            random_resting_pose(poses, probability, corners, region, np.random.RandomState(seed))
            for seed, _ in (seeds_of(run, "a", number) for number in range(n))
        ]
        return np.bincount([round(row[2]) - 1 for row in drawn], minlength=4)

    for n in (8, 24):
        off = {
            seeds_of: np.array([counts(seeds_of, run, n) - n * probability for run in range(10)])
            for seeds_of in (trial_seeds, spread_trial_seeds)
        }
        assert np.abs(off[spread_trial_seeds]).max() < 2
        assert off[spread_trial_seeds].std() < 0.5 * off[trial_seeds].std()
        assert np.abs(off[spread_trial_seeds].mean(axis=0)).max() < 0.5
