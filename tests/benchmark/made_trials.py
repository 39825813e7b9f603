"""Trials of a benchmark as they are stored, with errors that are known."""

from __future__ import annotations

from mskgrasp.trials.placed_trial import PlacedTrial
from tests.assess import made_trials


def made(number: int, planner: str = "ours", part: str = "nut", **changes) -> PlacedTrial:
    """A trial whose part ends 0.3 mm and 0.002 rad from its target.

    It moved by 4.2 mm in the hand, 0.2 mm more than predicted, was carried 0.05 mm aside, and released
    another 0.05 mm.
    """
    values = dict(
        part=part, condition="sapien", resting=None, seeing=[0.0004, 0.0003, 0.0],
        carried=[0.00005, 0.0, 0.0], placed=[0.0003, 0.0, 0.002],
    )  # fmt: skip
    return made_trials.made(number, planner=planner, **(values | changes))  # type: ignore[arg-type]


def failed(number: int, planner: str = "ours", reason: str = "slipped", **changes) -> PlacedTrial:
    """A trial that lifted nothing."""
    nothing = dict.fromkeys(("predicted", "measured", "held", "expected", "tilt", "placed", "carried"))
    return made(number, planner, lifted=False, reason=reason, **(nothing | changes))
