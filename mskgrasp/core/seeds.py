"""Seeds of scenes: the one formula from a run's seed, a part and a number."""

from __future__ import annotations

import zlib

import numpy as np


def scene_seeds(seed: int, part: str, number: int, draw: int = 0) -> tuple[int, int]:
    """Seeds of one scene with a part, the same for attempts, trials and placements.

    Args:
        seed: Seed of the run.
        part: Name of the part.
        number: Index of the attempt or trial among those of the part.
        draw: Number of times that the scene was drawn before.

    Returns:
        The seed of the part's place and turn, and that of a grasp drawn at random.
    """
    entropy = [seed, zlib.crc32(part.encode()), number, *([draw] if draw else [])]
    words = np.random.SeedSequence(entropy).generate_state(2) >> 1
    return int(words[0]), int(words[1])
