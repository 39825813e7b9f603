"""Tables of a stored validation, for the console and for a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import Table

Record = dict[str, Any]
_DIFFERENCES = ("success agrees", "shift median, mm", "90 %", "turn median, deg", "90 %")


def validation_sections(record: Record) -> list[Section]:
    """All sections of a validation's record."""
    found = [_closed_form(record["closed_form"]), _parts(record["parts"])]
    if "errors" in record:
        found += [
            _errors(record),
            _grid(record),
            _sensitivity(record),
            label_error_section(record),
            _impossible(record),
        ]
    return [section for section in found if section]


def _closed_form(checks: Sequence[Record]) -> Section:
    rows = [
        (
            "ok" if one["passed"] else "FAILED", one["name"], one["formula"], f"{one['expected']:.4g}",
            None if one["measured"] is None else f"{one['measured']:.4g}",
            f"{one['low']:.4g} .. {one['high']:.4g}", one["unit"],
        )
        for one in checks
    ]  # fmt: skip
    header = ("", "quantity", "formula", "expected", "measured", "tolerance", "unit")
    return Section(title="Closed-form physics", tables=[Table(header=header, rows=rows)])


def _parts(found: Sequence[Record]) -> Section:
    ratios = [one["volume_ratio"] for one in found]
    rows = [
        ("95 % of hull and mesh surfaces within", f"{1e3 * max(one['surface_p95'] for one in found):.2f} mm"),
        ("volume of hulls over volume of mesh", f"{min(ratios):.3f} .. {max(ratios):.3f}"),
        ("relative error of the engine's mass", f"{max(one['mass_error'] for one in found):.1e}"),
        ("relative error of the engine's inertia", f"{max(one['inertia_error'] for one in found):.1e}"),
    ]
    failed = [f"{one['part']} differs from its mesh: {one}" for one in found if not one["passed"]]
    title = f"{len(found)} parts in the physics engine against their meshes"
    return Section(title=title, text=failed, tables=[Table(header=("worst over parts", "value"), rows=rows)])


def _errors(record: Record) -> Section:
    rows = [
        (
            one["setting"], one["reference"], one["origin"], one["n"], *_differences(one),
            _millimetres(one["bias"], 3), *_tests(one),
        )
        for one in record["errors"]
    ]  # fmt: skip
    header = (
        "setting", "against", "contains", "n", *_DIFFERENCES, "bias, mm", "beyond the floor, mm",
        "success, points",
    )  # fmt: skip
    return Section(title="Errors by origin", tables=[Table(header=header, rows=rows)])


def _grid(record: Record) -> Section:
    production = record["production"]
    rows = [
        (
            f"{one['setting']} (production)" if one["setting"] == production else one["setting"], one["n"],
            _share(one["success_rate"]), *_differences(one), *_tests(one),
            "yes" if one["equivalent"] else "not shown", f"{one['cpu_ms']:.0f}",
        )
        for one in record["grid"]
    ]  # fmt: skip
    header = (
        "setting", "n", "success", *_DIFFERENCES, "beyond the floor, mm", "success, points", "equivalent",
        "CPU ms per grasp",
    )  # fmt: skip
    return Section(
        title=f"Settings against {record['yardstick']}",
        text=[choice_text(record)],
        tables=[Table(header=header, rows=rows)],
    )


def choice_text(record: Record) -> str:
    """Setting chosen by the tests of equivalence, and the reasons why production does not pass."""
    choice, margins = record["choice"], record["settings"]["margins"]
    within = f"{1e3 * margins['displacement']:g} mm and {1e2 * margins['success']:g} points of success"
    if choice["shown"]:
        said = (
            f"The cheapest setting that, with all finer ones, is equivalent within {within} is "
            f"{choice['setting']}."
        )
    else:
        said = (
            f"No setting is shown to be equivalent within {within}; the cheapest whose estimates are within "
            f"the margins, or that of least excess, is {choice['setting']}."
        )
    failing = "; ".join(choice["production_fails"])
    return f"{said} Production, {record['production']}: {failing or 'equivalent'}."


def _sensitivity(record: Record) -> Section:
    own = record["size"]
    rows: list[Sequence[object]] = [
        (
            "the displacement itself", "", "", own["n"], _share(own["success_rate"]), None,
            _millimetres(own["shift_median"]), _millimetres(own["shift_p90"]),
            _degrees(own["turn_median"]), _degrees(own["turn_p90"]),
        )
    ]  # fmt: skip
    group = ""
    for one in record["sensitivity"]:
        title = one["group"] if one["group"] != group else ""
        group = one["group"]
        rows.append(
            (title, one["label"], one["parts"], one["n"], _share(one["success_rate"]), *_differences(one))
        )
    header = ("varied", "value", "parts", "n", "success", *_DIFFERENCES)
    return Section(title="Sensitivity: differences to production", tables=[Table(header=header, rows=rows)])


def label_error_section(record: Record) -> Section:
    """The error of a label, and the ranges from which hand and table were drawn."""
    found = record["label_error"]
    if not found:
        return Section(title="Error of a label")
    rows = [(name, f"{low:g}", f"{high:g}") for name, (low, high) in found["ranges"].items()]
    return Section(
        title="Error of a label",
        text=[label_error_text(record)],
        tables=[Table(header=("drawn, uniformly", "from", "to"), rows=rows)],
    )


def label_error_text(record: Record) -> str:
    """The error of a label in a sentence, as for a dataset's card."""
    one = record["label_error"]
    if one["shift_median"] is None:
        return f"No grasp lifts the part both as it is and with hand and table drawn ({one['n']} grasps)."
    return (
        f"With the hand and the table drawn from their ranges, a label differs by "
        f"{_millimetres(one['shift_median'])} mm and {_degrees(one['turn_median'])} degrees (median), "
        f"{_millimetres(one['shift_p90'])} mm and {_degrees(one['turn_p90'])} degrees (90 %); success agrees "
        f"in {_share(one['agreement'])} ({one['n']} grasps)."
    )


def _impossible(record: Record) -> Section:
    found = record["impossible"]
    dropped = ", ".join(f"{count} {name}" for name, count in found["dropped"].items() if count) or "none"
    text = (
        f"Of {found['attempts']} attempts dropped as impossible, or drawn again as unsettled: {dropped}. In "
        f"the others the deepest overlap is {1e3 * found['penetration']:.2f} mm, the fastest part "
        f"{found['fastest']:.2f} m/s, the largest displacement of a success "
        f"{1e3 * found['displaced']:.1f} mm."
    )
    return Section(title="Attempts that are no labels", text=[text])


def _differences(one: Record) -> tuple[str | None, ...]:
    return (
        _share(one["agreement"]),
        _millimetres(one["shift_median"], 3),
        _millimetres(one["shift_p90"]),
        _degrees(one["turn_median"], 3),
        _degrees(one["turn_p90"]),
    )


def _tests(one: Record) -> tuple[str | None, str | None]:
    tests = one["equivalence"]
    return _interval(tests["displacement"], 1e3), _interval(tests["success"], 1e2)


def _interval(test: Record | None, scale: float) -> str | None:
    if test is None or test["estimate"] is None:
        return None
    return f"{scale * test['estimate']:.2f} ({scale * test['low']:.2f} .. {scale * test['high']:.2f})"


def _share(value: float | None) -> str | None:
    return None if value is None else f"{value:.1%}"


def _millimetres(value: float | None, digits: int = 2) -> str | None:
    return None if value is None else f"{1e3 * value:.{digits}f}"


def _degrees(value: float | None, digits: int = 2) -> str | None:
    return None if value is None else f"{math.degrees(value):.{digits}f}"
