"""Model card: training data, settings, held-out metrics and limits of a model, as Markdown."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.core.metrics import calibration_gap
from mskgrasp.core.settings import Physics
from mskgrasp.learning.grasp_models import ModelMeta
from mskgrasp.learning.label_source import LabelSource, source_text

_LIMITS = """\
- For a Franka Hand with its standard pads (80 mm opening), vertical grasps of a single part on a flat table,
  and a depth camera above it. Not for other grippers, inclined grasps or clutter.
- Labels are simulated: rigid parts of uniform density, Coulomb friction. Soft, wet or magnetic ones behave
  differently.
- The displacement is that of grasps that succeed. What happens when a grasp fails is not predicted.
- Large displacements, above all of round parts that roll between the pads, are predicted with a large
  deviation. Choose by the predicted deviation, not by the mean.
"""

_AXES = {"x": "x", "y": "y", "z": "z", "theta": "turn", "swing_x": "swing about x", "swing_y": "about y"}


def model_card(meta: ModelMeta) -> str:
    """Write the card of a model.

    Args:
        meta: Description of a trained model.
    """
    known = meta.training
    reports = {side: meta.metrics[side] for side in ("test", "new_sizes") if side in meta.metrics}
    settings = known.get("settings", {})
    sides = [len(known.get(f"{name}_parts", ())) for name in ("training", "validation", "test", "new_sizes")]
    lines = [
        "# Model card",
        "",
        "Predicts, for grasps of a parallel gripper from above, the probability that they lift the part, and",
        "how the part moves in the hand, with its uncertainty. Loaded by every program that plans.",
        "",
        "## Data",
        "",
        f"- {known.get('attempts', 0)} simulated training attempts, "
        f"{known.get('successes', 0)} of them successes",
        f"- {sides[0]} training parts, {sides[1]} validation parts (early stopping and calibration), "
        f"{sides[2]} test parts (held out from both), "
        f"{sides[3]} new_sizes parts (other sizes of families that were trained on)",
        f"- digest of grasps and outcomes: `{str(known.get('data_fingerprint', ''))[:16]}`",
        "",
        *(["## Labels", "", *map(_label_lines, meta.labels), ""] if meta.labels else []),
        "## Settings",
        "",
        *(f"- {name}: {_words(settings[name])}" for name in sorted(settings)),
        "",
        *(
            line
            for side, report in (reports or {"validation": meta.metrics}).items()
            for line in (f"## On held-out {side} parts", "", *_result_lines(report))
        ),
        "Intervals are of 95 %, bootstrapped over parts. RMSE is over all random grasps that succeeded;",
        "a planner chooses among those of which the network is most confident.",
        "",
        "## Limits",
        "",
        _LIMITS,
    ]
    return "\n".join(lines)


def _result_lines(report: dict[str, Any]) -> list[str]:
    return [line for rows in result_rows(report) for line in (*_table(rows), "")]


def _label_lines(source: LabelSource) -> str:
    """Simulation, camera and drawn errors, and settings that differ from the defaults, a line each."""
    usual = Physics().model_dump()
    other = [f"{name} {value}" for name, value in source.physics.items() if usual.get(name) != value]
    return (
        f"- {source_text(source)}; seed {source.seed}\n"
        f"- physics other than the defaults: {', '.join(other) or 'none'}"
    )


def result_rows(report: dict[str, Any]) -> list[list[tuple[str, ...]]]:
    """Tables of a model's metrics, each with its header first.

    Args:
        report: Metrics of one side of the data, by network.
    """
    tables = [_quality_rows(report["gqn"]), _displacement_rows(report["gdn"]), _axis_rows(report["gdn"])]
    return [rows for rows in tables if rows]


def _quality_rows(gqn: dict[str, Any]) -> list[tuple[str, ...]]:
    between = gqn.get("intervals", {})
    accuracy = _range(between.get("balanced_accuracy"), 100, " %")
    base_rate = f"Brier score (always the base rate: {gqn['brier_of_base_rate']:.3f})"
    return [
        ("quality", "value", "95 % interval"),
        ("grasps", str(gqn["n"]), ""),
        ("accuracy on balanced data", f"{gqn['balanced_accuracy']:.1%}", accuracy),
        ("AUROC", f"{gqn['auroc']:.3f}", _range(between.get("auroc"))),
        (base_rate, f"{gqn['brier']:.3f}", _range(between.get("brier"))),
        ("expected calibration error, ten bins", f"{calibration_gap(np.array(gqn['reliability'])):.1%}", ""),
    ]


def _displacement_rows(gdn: dict[str, Any]) -> list[tuple[str, ...]]:
    units = {"translation_rmse": 1e3, "rotation_rmse": math.degrees(1)}
    between = gdn.get("intervals", {})
    network = [f"{factor * gdn[key]:.2f} {_range(between.get(key), factor)}" for key, factor in units.items()]
    rows = [("network, and 95 % interval", *network)]
    for name in ("zero_displacement", "training_mean"):
        values = (f"{factor * gdn[name][key]:.2f}" for key, factor in units.items())
        rows.append((f"predicting {name.replace('_', ' ')}", *values))
    for share, (translation, rotation, *tilted) in gdn.get("least_uncertain", {}).items():
        values = (f"{1e3 * translation:.2f}", f"{math.degrees(rotation):.2f}")
        rows.append((f"the most confident {share}", *values, *(f"{one:.1%}" for one in tilted)))
    head = (
        f"displacement of {gdn['n']} successes", "translation RMSE, mm", "rotation RMSE, degrees",
        f"tilt over {math.degrees(TILT_LIMIT):.0f} degrees",
    )  # fmt: skip
    n_columns = max(map(len, rows))  # earlier models do not tell the tilt
    return [head[:n_columns], *((*row, "", "")[:n_columns] for row in rows)]


def _axis_rows(gdn: dict[str, Any]) -> list[tuple[str, ...]]:
    axes = gdn.get("axes")
    if not axes:
        return []
    names = tuple(axes["rmse"])
    rows: list[tuple[str, ...]] = [
        ("by axis of the grasp displacement", *(f"{_AXES[name]}, {_unit_of(name)[1]}" for name in names))
    ]
    for key, label in (("rmse", "RMSE"), ("crps", "CRPS"), ("sharpness", "mean predicted deviation")):
        rows.append((label, *(f"{_unit_of(name)[0] * axes[key][name]:.2f}" for name in names)))
    for level in (50, 80, 90, 95):
        rows.append(
            (f"inside the {level} % interval", *(f"{axes[f'coverage_{level}'][name]:.1%}" for name in names))
        )
    each = ", ".join(f"{name} {gdn[f'ause_{name}']:.2f}" for name in ("translation", "rotation"))
    ause = f"AUSE, relative to a random order: {each}"
    return [*rows, (ause, *("" for _ in names))]


def _unit_of(axis: str) -> tuple[float, str]:
    return (1e3, "mm") if axis in ("x", "y", "z") else (math.degrees(1), "degrees")


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    head, *body = ("| " + " | ".join(row) + " |" for row in rows)
    return [head, "|" + "---|" * len(rows[0]), *body]


def _range(ends: Any, factor: float = 1.0, unit: str = "") -> str:
    known = ends and None not in ends and not np.isnan(ends).any()
    return f"({factor * ends[0]:.3g} - {factor * ends[1]:.3g}{unit})" if known else ""


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_words(item)}" for name, item in value.items())
    return " x ".join(map(str, value)) if isinstance(value, list) else str(value)
