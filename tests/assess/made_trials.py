"""Trials of an assessment as they are stored, with errors that are known."""

from __future__ import annotations

from mskgrasp.assess.trials import EXACT, PlannerName
from mskgrasp.trials.placed_trial import PlacedTrial


def made(
    number: int, *, planner: PlannerName = "certified", condition: str = EXACT, **changes
) -> PlacedTrial:
    """A trial that ends 0.3 mm from its target, with a part that moved by 4 mm and 3 degrees in the hand."""
    values = dict(
        part="bracket",
        condition=condition,
        number=number,
        planner=planner,
        planned_by=planner,
        lifted=True,
        resting=0,
        quality=0.96,
        grasp=[0.5, 0.0, 0.0105, 0.2],
        predicted=[0.004, 0.0, 0.0, 0.05],
        measured=[0.0042, 0.0, 0.0, 0.052],
        held=[0.0042, 0.0, 0.0, 0.052],
        expected=[0.004, 0.0, 0.0, 0.05],
        tilt=0.001,
        placed=[0.0003, 0.0, 0.002],
    )
    return PlacedTrial(**(values | changes))  # type: ignore[arg-type]


def failed(number: int, reason: str = "slipped", **changes) -> PlacedTrial:
    """A trial that lifted nothing."""
    nothing = dict.fromkeys(("predicted", "measured", "held", "expected", "tilt", "placed"))
    return made(number, lifted=False, reason=reason, **(nothing | changes))
