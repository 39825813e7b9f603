"""Rows of the summary of results, each a function of a stored report."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mskgrasp.benchmark.report import TOLERANCE
from mskgrasp.benchmark.summary import stored_row
from mskgrasp.evaluate.comparison import POLICY_NAMES
from mskgrasp.palletize.report import GOAL, verdict
from mskgrasp.validate.config import SHIFTED
from tests.benchmarks.paper_choices import OURS, PAPER_AS_OURS
from tests.docs.stored_reports import StoredReport

PAPER = dict(translation=2.4e-3, rotation=math.radians(7.0))
"""Zhao, Liang and Kroemer (arXiv 1909.02129): displacement RMSE in simulation at high quality and low
variance, known and novel objects pooled, m and rad."""


@dataclass(frozen=True, kw_only=True)
class SummaryRow:
    """A row, as Markdown; split and n are those of the stored run unless stated.

    Attributes:
        name: Subject, linked to the results page.
        text: The figures.
        interval: Of each figure, in the same order.
        split: Parts of these figures alone.
        n: Of these figures alone.
    """

    name: str
    text: str
    interval: str
    split: str = ""
    n: str = ""


def _exact(stored: StoredReport) -> str:
    """That depth images had no noise; runs with it name it in their command."""
    return "" if "--noise" in stored.facts["command"] else ", no sensor noise"


def _success(stored: StoredReport) -> list[SummaryRow]:
    found = _report(stored)["overall"]
    return [
        SummaryRow(
            name="best quality",
            text=f"{found['success_rate']:.1%} lifted{_exact(stored)} "
            f"(paper in simulation: {_report(stored)['paper']['simulated']:.1%})",
            interval=_between(found["success_interval"], 100, "%"),
        ),
        SummaryRow(
            name="best quality",
            text=f"displacement RMSE {_rmse(found)} about the vertical (predicting zero: "
            f"{_rmse(found, '_of_zero')}); {found['tilted']['value']:.1%} hang tilted by more than 2 degrees",
            interval=f"{_rmse_intervals(found)}; {_between(found['tilted']['interval'], 100, '%')}",
            n=f"{found['measured']} trials of {found['measured_parts']} parts that were lifted",
        ),
    ]


def _success_elsewhere(where: str) -> Callable[[StoredReport], list[SummaryRow]]:
    """A row of grasps of the best quality, under other conditions."""

    def rows(stored: StoredReport) -> list[SummaryRow]:
        found = _report(stored)["overall"]
        return [
            SummaryRow(
                name=f"best quality, {where}",
                text=f"{found['success_rate']:.1%} lifted; displacement RMSE {_rmse(found)} "
                f"(predicting zero: {_rmse(found, '_of_zero')})",
                interval=f"{_between(found['success_interval'], 100, '%')}; {_rmse_intervals(found)}",
            )
        ]

    return rows


def _rmse(statistics: dict[str, Any], of: str = "") -> str:
    return f"{_mm(statistics[f'translation_rmse{of}'])}, {_degrees(statistics[f'rotation_rmse{of}'])}"


def _displacement(stored: StoredReport) -> list[SummaryRow]:
    paper = f"{_mm(PAPER['translation'])}, {_degrees(PAPER['rotation'])}"
    return [
        _displacement_row(
            stored, "low_variance", "high quality, low variance, as in the paper", f"; paper: {paper}"
        ),
        _displacement_row(stored, "recentred", "high quality, low variance, recentred"),
    ]


def _displacement_elsewhere(where: str) -> Callable[[StoredReport], list[SummaryRow]]:
    """A row of the grasps that `plan` chooses, under other conditions."""
    return lambda stored: [_displacement_row(stored, "recentred", f"the same {where}")]


def _displacement_row(stored: StoredReport, policy: str, name: str, theirs: str = "") -> SummaryRow:
    model = next(iter(_report(stored)["models"].values()))
    both, novel, best = model[policy]["all"], model[policy]["novel"], model["quality"]["all"]
    return SummaryRow(
        name=name,
        text=f"{both['success_rate']:.1%} lifted{_exact(stored)} (best quality in the same scenes: "
        f"{best['success_rate']:.1%}); displacement RMSE {_rmse(both)} "
        f"(predicting zero: {_rmse(both, '_of_zero')}{theirs}); "
        f"novel parts alone: {novel['success_rate']:.1%}, {_rmse(novel)}",
        interval=f"{_between(both['success_interval'], 100, '%')}; {_rmse_intervals(both)}; "
        f"{_rmse_intervals(novel)}",
        n=f"{both['trials']} trials of {both['measured_parts']} parts, {novel['trials']} of "
        f"{novel['measured_parts']} novel ones; {both['measured']} and {novel['measured']} lifted",
    )


def _certified_compared(stored: StoredReport) -> list[SummaryRow]:
    found = _report(stored)["policies"][POLICY_NAMES["certified"]]
    return [_certified_row(found, "the catalogue's parts, exact camera, beside the networks")]


def _certified(parts: str, where: str) -> Callable[[StoredReport], list[SummaryRow]]:
    """A row of certified grasps of some parts under some conditions."""
    return lambda stored: [_certified_row(_report(stored)["overall"], f"{parts}, {where}")]


def _certified_row(found: dict[str, Any], where: str) -> SummaryRow:
    certified, planned = found["certified"]
    rotation = math.degrees(found["rotation_rmse"])
    zero = _rmse(found, "_of_zero")
    return SummaryRow(
        name="certified grasps, by the CAD",
        text=f"{where}: {found['success_rate']:.1%} lifted, displacement RMSE "
        f"{1e3 * found['translation_rmse']:.2f} mm, {rotation:.2f} degrees (predicting zero: {zero}); "
        f"{certified} of {planned} planned grasps are certified",
        interval=f"{_between(found['success_interval'], 100, '%')}; {_rmse_intervals(found, 2)}",
        n=f"{found['trials']} trials of {found['measured_parts']} parts",
    )


def _assessed(stored: StoredReport) -> list[SummaryRow]:
    whole, agreement, parts = _report(stored)["tables"]
    fresh = dict(zip(whole["header"], whole["rows"][-1], strict=True))
    (agrees,) = (row[-1] for row in agreement["rows"] if row[0] == "1 mm")
    turned = sum(row[-1] == "yes" for row in parts["rows"])
    share, between = fresh["placed within 1 mm"].rstrip("]").split(" [")
    return [
        SummaryRow(
            name="assessed parts in fresh scenes",
            text=f"{share} of all attempts placed within 1 mm, corrected by the prediction of certified "
            f"grasps; the share of each part lies within the (wide) interval that its report stated from a "
            f"few trials for {agrees} parts, for {turned} where the turn must be within 2 degrees, too",
            interval=between.replace("%, ", " - ").replace("%", " %"),
            n=f"{fresh['trials']} attempts",
        )
    ]


def _benchmark(stored: StoredReport) -> list[SummaryRow]:
    rows = {row["planner"]: stored_row(row) for row in _report(stored)["rows"]}
    ours = rows["ours"]
    corrected, plain, simple = ours.first("predicted"), ours.first("none"), rows["centroid"].first("none")
    shares = [corrected, plain, simple]
    text = (
        f"{corrected.value:.1%} of all attempts corrected by the prediction, {plain.value:.1%} "
        f"without{_exact(stored)}; centroid and short axis {simple.value:.1%}"
    )
    if "paper" in rows:
        theirs = rows["paper"].first("predicted")
        shares.append(theirs)
        text += (
            "; the paper's network and choice of grasps, from far fewer attempts, corrected by its "
            f"prediction, {theirs.value:.1%}"
        )
    if "certified" in rows:
        known, known_plain = (rows["certified"].first(name) for name in ("predicted", "none"))
        shares += [known, known_plain]
        text += (
            f"; certified grasps, by the CAD, {known.value:.1%}, without correction {known_plain.value:.1%}"
        )
    cell = ", in MuJoCo" if stored.name == "benchmark_mujoco" else ""
    cell += ", with certified grasps" if "certified" in rows else ""
    return [
        SummaryRow(
            name=f"placed within {TOLERANCE}{cell}",
            text=text,
            interval="; ".join(_between(one.interval, 100, "%") for one in shares),
            n=f"{corrected.of} attempts at {ours.n_parts} parts by each planner",
        )
    ]


def _palletize(stored: StoredReport) -> list[SummaryRow]:
    report = _report(stored)
    each = [report["corrections"][name] for name in ("predicted", "none", "truth")]
    gain = report["gain"]["predicted"]
    met = verdict(gain["translation_ratio"], gain["translation_ratio_interval"])
    corrected, plain, true = (
        f"{1e3 * one['median_translation']:.2f} mm, {_degrees(one['median_rotation'])}" for one in each
    )
    return [
        SummaryRow(
            name="placing, grasps of best quality" if stored.name == "palletize_quality" else "placing",
            text=f"median error {corrected} corrected by the prediction; {plain} without; {true} corrected "
            f"by the true displacement{_exact(stored)}; corrected by the prediction it is "
            f"{gain['translation_ratio']:.2f} of that without (goal: {GOAL:g} at most, {met})",
            interval="; ".join(_between(one["median_translation_interval"], 1e3, "mm", 2) for one in each)
            + f"; ratio {_between(gain['translation_ratio_interval'], 1, '', 2).rstrip()}",
            n=f"{report['compared']} placements of {report['parts_compared']} parts for each correction",
        )
    ]


def _shipped_model(stored: StoredReport) -> list[SummaryRow]:
    report = _report(stored)["metrics"]["test"]
    quality, displacement = report["gqn"], report["gdn"]
    between = displacement["intervals"]
    return [
        SummaryRow(
            name="random grasps",
            text=f"quality accuracy on balanced data {quality['balanced_accuracy']:.1%}",
            interval=_between(quality["intervals"]["balanced_accuracy"], 100, "%"),
            n=f"{quality['n']} grasps",
        ),
        SummaryRow(
            name="random grasps",
            text=f"displacement RMSE {1e3 * displacement['translation_rmse']:.2f} mm, "
            f"{math.degrees(displacement['rotation_rmse']):.2f} degrees",
            interval=f"{_between(between['translation_rmse'], 1e3, 'mm', digits=2)}, "
            f"{_between(between['rotation_rmse'], math.degrees(1), 'degrees', digits=2)}",
            n=f"{displacement['n']} grasps that lifted the part",
        ),
    ]


def _errors(one: dict[str, Any]) -> str:
    return f"{_mm(one['translation']['mean'])}, {_degrees(one['rotation']['mean'])}"


def _error_intervals(one: dict[str, Any]) -> str:
    translation, rotation = one["translation"]["interval"], one["rotation"]["interval"]
    return f"{_between(translation, 1e3, 'mm')}, {_between(rotation, math.degrees(1), 'degrees')}"


def _equal_recipes(stored: StoredReport) -> list[SummaryRow]:
    found = _report(stored)["scores"]["novel"]
    ours, paper = (
        (one, f"{one['balanced_accuracy']['mean']:.1%} accurate, {_errors(one)}")
        for one in (found[OURS], found[PAPER_AS_OURS])
    )
    trained = _report(stored)["n"].partition(",")[0]  # "trained on ... attempts at ... parts"
    text = f"{trained}, both by our recipe: ours {ours[1]}; the paper's network {paper[1]}"
    interval = "; ".join(
        f"{_between(one['balanced_accuracy']['interval'], 100, '%')}, {_error_intervals(one)}"
        for one, _ in (ours, paper)
    )
    first = ours[0]
    n = f"{first['n']} grasps of {first['parts']} parts, {first['successes']} successes; three trainings each"
    split = stored.facts["split"].partition(";")[0]
    return [SummaryRow(name="random grasps", text=text, interval=interval, split=split, n=n)]


def _paper_networks(stored: StoredReport) -> list[SummaryRow]:
    scores = {
        name.partition(",")[0]: one
        for name, one in _report(stored)["scores"]["novel"].items()
        if name == OURS or name.endswith(", our recipe")
    }
    return [
        SummaryRow(
            name="random grasps, all networks",
            text="displacement RMSE by our recipe: "
            + "; ".join(f"{name} {_errors(one)}" for name, one in scores.items()),
            interval="; ".join(f"{name} {_error_intervals(one)}" for name, one in scores.items()),
            split=stored.facts["split"].partition(";")[0],
            n=f"{scores[OURS]['successes']} successes of {scores[OURS]['parts']} parts; one training each",
        )
    ]


def _displacement_networks(stored: StoredReport) -> list[SummaryRow]:
    models = _report(stored)["models"]

    def row(name: str, policy: str) -> SummaryRow:
        # Without variances a network chooses none; LOWESS knows no novel part.
        of = {model: one[policy]["novel"] for model, one in models.items() if one[policy]}
        of = {model: one for model, one in of.items() if one["trials"]}
        return SummaryRow(
            name=name,
            text="displacement RMSE "
            + "; ".join(
                f"{model} {_rmse(one)}, {one['within'][0]['value']:.1%} of all attempts off by at most 1 mm"
                for model, one in of.items()
            ),
            interval="; ".join(
                f"{_rmse_intervals(one)}, {_between(one['within'][0]['interval'], 100, '%')}"
                for one in of.values()
            ),
            n=f"{of[OURS]['trials']} trials of {of[OURS]['measured_parts']} parts with each",
        )

    return [
        row("grasps of best quality, predicted by networks that learned the same", "quality"),
        row("grasps that these networks choose, recentred", "recentred"),
    ]


def _validation(stored: StoredReport) -> list[SummaryRow]:
    report = _report(stored)
    finest = "{rate_hz} Hz, {position_iterations} it".format(**report["settings"]["references"][1])
    yardstick = report["yardstick"]
    return [
        _against(report, "production", yardstick, "labels against finer steps"),
        _against(report, "production", finest, "the same against the finest steps"),
        _against(report, finest, yardstick, "these finer steps against the finest"),
    ]


def _against(report: dict[str, Any], setting: str, reference: str, name: str) -> SummaryRow:
    """A row of the errors of one setting against another."""
    pair = (setting, reference)
    (found,) = (one for one in report["errors"] if (one["setting"], one["reference"]) == pair)
    shift, success = found["equivalence"]["displacement"], found["equivalence"]["success"]
    shown = "shown" if found["equivalent"] else "not shown"
    steps = [report.get(one, one).replace(" it", " iterations") for one in pair]
    return SummaryRow(
        name=name,
        text=f"{' against '.join(steps)}: median displacement {1e3 * shift['estimate']:.2f} mm beyond that "
        f"of starts moved by 10 um, success {100 * success['estimate']:+.1f} points; equivalence within "
        f"{1e3 * shift['margin']:g} mm and {100 * success['margin']:g} points is {shown}",
        interval=f"90 %: {_between((shift['low'], shift['high']), 1e3, 'mm', digits=2)}, "
        f"{_between((success['low'], success['high']), 100, 'points')}",
        n=f"{found['n']} grasps of {success['parts']} parts; {shift['n']} of {shift['parts']} parts lifted "
        "in both and from the moved starts",
    )


def _engines(stored: StoredReport) -> list[SummaryRow]:
    report = _report(stored)
    whole, between = report["engines"]["all"], report["intervals"]
    parts = [name for name in report["engines"] if name != "all" and not name.endswith(SHIFTED)]
    shifts = (_between(between[name], 1e3, "mm", digits=2) for name in ("shift_median", "shift_p90"))
    return [
        SummaryRow(
            name="labels against a second engine, MuJoCo",
            text=f"success agrees in {whole['agreement']:.1%}; where both lift the part, displacement "
            f"differs by {1e3 * whole['shift_median']:.2f} mm (median; 90th percentile "
            f"{1e3 * whole['shift_p90']:.2f} mm)"
            + "".join(f"; bound missed: {one}" for one in report["failed"]),
            interval=f"{_between(between['agreement'], 100, '%')}; {'; '.join(shifts)}",
            n=f"{whole['n']} grasps of {len(parts)} parts, {whole['n_both']} lifted in both",
        )
    ]


def _collect(stored: StoredReport) -> list[SummaryRow]:
    cells = _cells(stored)
    text = f"{cells['grasps/s']} grasps/s, {cells['time']} for the demo dataset"
    return [SummaryRow(name="collecting", text=text, interval=stored.facts["intervals"])]


def _plan(stored: StoredReport) -> list[SummaryRow]:
    times, ratios = _report(stored)["tables"]
    ours, paper = (dict(zip(times["header"], row, strict=True)) for row in times["rows"][:2])
    machine = stored.facts["machine"].partition(",")[0]
    text = (
        f"{ours['median, ms']} ms with the shipped model on {machine}; the paper's network "
        f"{paper['median, ms']} ms, {ratios['rows'][0][1]} times as long (both in bfloat16: "
        f"{ratios['rows'][1][1]} times)"
    )
    return [SummaryRow(name="planning", text=text, interval=f"{ours['interval of the median']} ms")]


def _cells(stored: StoredReport) -> dict[str, str]:
    """First row of a report's first table, by column."""
    first = _report(stored)["tables"][0]
    return dict(zip(first["header"], first["rows"][0], strict=True))


def _report(stored: StoredReport) -> dict[str, Any]:
    assert isinstance(stored.report, dict)
    return stored.report


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.1f} mm"


def _degrees(radians: float) -> str:
    return f"{math.degrees(radians):.1f} degrees"


def _rmse_intervals(found: dict[str, Any], digits: int = 1) -> str:
    translation = _between(found["translation_interval"], 1e3, "mm", digits)
    return f"{translation}, {_between(found['rotation_interval'], math.degrees(1), 'degrees', digits)}"


def _between(ends: Any, scale: float, unit: str, digits: int = 1) -> str:
    low, high = (f"{scale * end:.{digits}f}" for end in ends)
    return f"{low} to {high} {unit}" if "-" in low + high else f"{low} - {high} {unit}"


ROWS: tuple[tuple[str, Callable[[StoredReport], list[SummaryRow]]], ...] = (
    ("success", _success),
    ("success_kinect2", _success_elsewhere("with the noise of a Kinect v2")),
    ("success_iid", _success_elsewhere("with independent noise of every pixel")),
    ("success_mujoco", _success_elsewhere("in MuJoCo")),
    ("displacement", _displacement),
    ("displacement_mujoco", _displacement_elsewhere("in MuJoCo")),
    ("displacement_kinect2", _displacement_elsewhere("with the noise of a Kinect v2")),
    ("certified", _certified_compared),
    (
        "success_certified",
        _certified("the catalogue's parts", "exact camera, the engine that certified them"),
    ),
    ("success_certified_kinect2", _certified("the catalogue's parts", "noise of a Kinect v2")),
    (
        "success_certified_mujoco",
        _certified("the catalogue's parts", "in MuJoCo (tuned on these parts, see its page)"),
    ),
    (
        "success_certified_mujoco_validation",
        _certified("validation parts", "in MuJoCo (not used for tuning)"),
    ),
    ("success_certified_cad", _certified("imported CAD", "exact camera")),
    ("success_certified_cad_kinect2", _certified("imported CAD", "noise of a Kinect v2")),
    (
        "success_certified_cad_mujoco",
        _certified("imported CAD", "in MuJoCo (tuned on these parts, see its page)"),
    ),
    ("assessed", _assessed),
    ("assessed_catalogue", _assessed),
    ("benchmark", _benchmark),
    ("benchmark_mujoco", _benchmark),
    ("benchmark_certified", _benchmark),
    ("palletize", _palletize),
    ("palletize_quality", _palletize),
    ("shipped_model", _shipped_model),
    ("equal_recipes", _equal_recipes),
    ("paper_networks", _paper_networks),
    ("displacement_networks", _displacement_networks),
    ("validation", _validation),
    ("engines", _engines),
    ("collect", _collect),
    ("plan_speed", _plan),
)
"""Name of each report of the table, and its rows; one that is not stored yet has none."""


def rows_of(stored: StoredReport) -> list[SummaryRow]:
    """Rows of a stored report of any size: its own, or those of the longest beginning of its name.

    Raises:
        KeyError: There are none.
    """
    by_name, name = dict(ROWS), stored.name
    while name and name not in by_name:
        name = name.rpartition("_")[0]
    return by_name[name](stored)


IN_README = (
    "success",
    "success_kinect2",
    "displacement",
    "displacement_mujoco",
    "displacement_kinect2",
    "success_certified",
    "success_certified_mujoco",
    "success_certified_mujoco_validation",
    "success_certified_cad_kinect2",
    "assessed",
    "benchmark",
    "benchmark_mujoco",
    "benchmark_certified",
    "palletize",
    "palletize_quality",
    "shipped_model",
    "equal_recipes",
    "engines",
    "plan_speed",
)
"""Reports of the rows that the README shows, too."""
