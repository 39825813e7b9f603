"""Parts of many convex pieces: the more of them the pads touch, the longer the solver takes."""

USUAL_HULLS = 48
"""Convex pieces up to which a part gets all simulations and trials; the catalogue's parts have no more.
Imported ones have up to 128."""


def hull_excess(n_hulls: int) -> float:
    """Number of pieces over `USUAL_HULLS`, at least 1."""
    return max(1.0, n_hulls / USUAL_HULLS)
