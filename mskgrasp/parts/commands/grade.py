"""Grades of parts in words, with what they mean for labels."""

from __future__ import annotations

from collections.abc import Iterable

from mskgrasp.parts.part import FINE_P95_MM, Part

FINE_SHIFT_MM = (0.12, 2.7)
"""Shift of a label by hulls at the bound of a fine part: median and 90 % of the grasps, mm.

Sensitivity in docs/results/validation.md, hulls joined within 0.7 mm.
"""


def grade_text(part: Part) -> str:
    """Grade and distance of the hulls, as in ``coarse, 95 % of the surface within 1.24 mm``."""
    return f"{part.grade}, 95 % of the surface within {1e3 * part.hull_error_p95:.2f} mm"


def coarse_note(parts: Iterable[Part]) -> str | None:
    """One line on what coarse hulls mean for labels; None where all parts are fine."""
    coarse = [part for part in parts if part.grade == "coarse"]
    if not coarse:
        return None
    median, most = FINE_SHIFT_MM
    names = ", ".join(f"{part.name} ({1e3 * part.hull_error_p95:.2f} mm)" for part in coarse)
    return (
        f"coarse: {names}. At {FINE_P95_MM} mm, the bound of a fine part, hulls shift a label by {median} mm "
        f"(median) and {most} mm (90 %), those of coarse parts by more; collect leaves them out unless "
        "part_filter.coarse is true"
    )
