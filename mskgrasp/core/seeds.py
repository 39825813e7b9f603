"""Seeds of scenes, from a run's seed, a part and a number."""

from __future__ import annotations

import itertools
import zlib

import numpy as np

_TRIAL = zlib.crc32(b"trial")
_GOLDEN = (5**0.5 - 1) / 2
_NEAR = 1 / 64
"""Distance within which a scene's first random number counts as the one wanted."""


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


def trial_seeds(seed: int, part: str, number: int, *, spread: bool = False) -> tuple[int, int]:
    """Seeds of the scene of a trial or placement, whatever the planner.

    No dataset has this scene, not even one of the same seed: a network meets no image that it learned.

    Args:
        seed: Seed of the run.
        part: Name of the part.
        number: Index of the trial among those of the part.
        spread: Resting poses are as frequent as they are probable, however few the trials. The first random
            number of a scene decides its pose (`mskgrasp.parts.resting_pose`); those of consecutive trials
            follow the golden ratio's sequence, which fills the unit interval evenly (Weyl).

    Returns:
        The seed of the part's place and turn, and that of all that is drawn after it.
    """
    words = [seed, zlib.crc32(part.encode()), number, 0, _TRIAL]
    if not spread:
        return _two_words(words)
    wanted = np.random.default_rng([seed, words[1], _TRIAL]).random() + number * _GOLDEN
    drawn = (_two_words([*words, draw]) for draw in itertools.count(1))
    return next(seeds for seeds in drawn if _turns_apart(_first_number(seeds[0]), wanted) < _NEAR)


def _first_number(scene: int) -> float:
    return np.random.RandomState(scene).random_sample()


def _turns_apart(first: float, second: float) -> float:
    """Distance of two numbers on a circle of circumference one."""
    off = first - second
    return abs(off - round(off))


def _two_words(entropy: list[int]) -> tuple[int, int]:
    words = np.random.SeedSequence(entropy).generate_state(2) >> 1
    return int(words[0]), int(words[1])
