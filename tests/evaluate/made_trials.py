"""Hand-made trials, and the console's report on a summary of them."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from mskgrasp.evaluate.comparison import DisplacementSummary
from mskgrasp.evaluate.report import Report, print_report
from mskgrasp.evaluate.summary import SuccessSummary
from mskgrasp.trials.trial import Trial


def trial(**changes: object) -> Trial:
    values = dict(
        part="a", number=0, seed=1, success=True, reason="", grasp=[0.5, 0.0, 0.02, 0.0], quality=0.9,
        point_base=[0.5, 0.01, 0.015],
        predicted=[0.003, 0.0, 0.0, 0.1], predicted_std=[0.001] * 4, measured=[0.0, 0.004, 0.0, -0.1],
        tilt=0.0, planning_s=1.0, family="nut", policy="quality",
    )  # fmt: skip
    return Trial(**(values | changes))  # type: ignore[arg-type]


NOTHING = dict(
    success=False, reason="no part found", grasp=None, quality=None, predicted=None, predicted_std=None,
    measured=None, planning_s=None,
)  # fmt: skip


class Model:
    """Trained on part a."""

    has_variance = True

    def knows(self, part: str) -> bool:
        return part == "a"


def report_of(summary: SuccessSummary | DisplacementSummary) -> Report:
    return Report(summary=summary, trials={}, worst={}, settings={}, versions={})


def printed(summary: SuccessSummary | DisplacementSummary) -> str:
    stream = io.StringIO()
    print_report(report_of(summary), Path("out"), Console(file=stream, width=200))
    return stream.getvalue()
