"""Seeds of scenes: fixed by what datasets and runs were made with, and different for every scene."""

from __future__ import annotations

import itertools

from mskgrasp.core.seeds import scene_seeds, trial_seeds


def test_the_seeds_are_those_that_datasets_were_made_with():
    assert scene_seeds(0, "hex_nut_m30", 0) == (1936012876, 1649974050)
    assert scene_seeds(3, "washer_m36", 41) == (176129170, 1375270067)


def test_seed_part_and_number_all_make_another_scene():
    for seeds in (scene_seeds, trial_seeds):
        scenes = {seeds(seed, part, number) for seed in (0, 1) for part in "ab" for number in (0, 1)}
        assert len(scenes) == 8


def test_no_trial_has_a_scene_of_a_dataset():
    of_data = {
        scene_seeds(seed, "a", number, draw)[0]
        for seed, number, draw in itertools.product(range(3), range(200), range(5))
    }
    assert len(of_data) == 3000
    assert not of_data & {trial_seeds(seed, "a", number)[0] for seed in range(3) for number in range(200)}
