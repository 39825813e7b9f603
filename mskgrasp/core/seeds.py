"""Seeds of scenes, from a run's seed, a part and a number."""

from __future__ import annotations

import zlib

import numpy as np

_TRIAL = zlib.crc32(b"trial")


def scene_seeds(seed: int, part: str, number: int, draw: int = 0) -> tuple[int, int]:
    """Seeds of the scene of an attempt of a dataset.

    Args:
        seed: Seed of the run.
        part: Name of the part.
        number: Index of the attempt among those of the part.
        draw: Number of times that the scene was drawn before.

    Returns:
        The seed of the part's place and turn, and that of a grasp drawn at random.
    """
    return _two_words([seed, zlib.crc32(part.encode()), number, *([draw] if draw else [])])


def trial_seeds(seed: int, part: str, number: int) -> tuple[int, int]:
    """Seeds of the scene of a trial or placement, whatever the planner.

    No dataset has this scene, not even one of the same seed: a network meets no image that it learned.

    Args:
        seed: Seed of the run.
        part: Name of the part.
        number: Index of the trial among those of the part.

    Returns:
        The seed of the part's place and turn, and that of all that is drawn after it.
    """
    return _two_words([seed, zlib.crc32(part.encode()), number, 0, _TRIAL])


def _two_words(entropy: list[int]) -> tuple[int, int]:
    words = np.random.SeedSequence(entropy).generate_state(2) >> 1
    return int(words[0]), int(words[1])
