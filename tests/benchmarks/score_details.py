"""Further scores of predictions: ranking of qualities, likelihood, order of the uncertainties."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from mskgrasp.core import metrics
from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.learning.held_out import centroid_errors, prediction_errors, variance_score
from mskgrasp.learning.samples import Samples
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.choice import Predictions
from tests.benchmarks.scores import MOST_CONFIDENT


def details_of(samples: Samples, rows: torch.Tensor, seeds: Sequence[Predictions]) -> dict[str, float]:
    """Means over seeds of AUROC and Brier score of the quality, and of NLL, area under the sparsification
    error and share of tilted parts among the most confident tenth, of the displacement."""
    each = [_details(samples, rows, one) for one in seeds]
    return {name: float(np.mean([one[name] for one in each])) for name in each[0]}


def _details(samples: Samples, rows: torch.Tensor, one: Predictions) -> dict[str, float]:
    found: dict[str, float] = {}
    if len(one.quality):
        success = samples.success[rows].numpy()
        found |= {
            "AUROC": metrics.auroc(one.quality, success),
            "Brier": metrics.brier(one.quality, success),
        }
    rows = rows[samples.success[rows]]
    if not np.isfinite(one.variance).all():
        return found
    shift, _, expected = centroid_errors(samples, rows, one.mean, one.variance)
    nll = prediction_errors(samples, rows, one.mean, one.variance).nll
    assert nll is not None
    kept = np.argsort(variance_score(one.mean, one.variance, expected), kind="stable")
    kept = kept[: max(1, round(MOST_CONFIDENT * len(kept)))]
    tilted = samples.swing[rows].norm(dim=1).numpy()[kept] > TILT_LIMIT
    return found | {
        "NLL": nll,
        "AUSE": metrics.ause(shift, expected[:, :3].sum(axis=1)),
        f"most confident {MOST_CONFIDENT:.0%}: tilted": float(tilted.mean()),
    }


def detail_table(details: dict[str, dict[str, float]]) -> Table:
    """The table of further scores, a row a choice."""
    names = list(dict.fromkeys(name for one in details.values() for name in one))
    rows = [
        (choice, *(f"{one[name]:.3f}" if name in one else None for name in names))
        for choice, one in details.items()
    ]
    return Table(header=("", *names), rows=rows)
