"""Seeds of scenes: fixed by what datasets were made with, and different for every scene."""

from __future__ import annotations

from mskgrasp.core.seeds import scene_seeds


def test_the_seeds_are_those_that_datasets_were_made_with():
    assert scene_seeds(0, "hex_nut_m30", 0) == (1936012876, 1649974050)
    assert scene_seeds(3, "washer_m36", 41) == (176129170, 1375270067)


def test_seed_part_and_number_all_make_another_scene():
    scenes = {scene_seeds(seed, part, number) for seed in (0, 1) for part in "ab" for number in (0, 1)}
    assert len(scenes) == 8
