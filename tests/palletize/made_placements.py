"""Hand-made placements whose medians are known."""

from __future__ import annotations

from mskgrasp.palletize.placement_records import Correction, Placement


def placement(part: str, number: int, correction: Correction, error_mm: float | None, **changes) -> Placement:
    values = dict(
        part=part, number=number, slot=0, correction=correction, target=(0.5, 0.0, 1.0),
        placed=error_mm is not None, reason="" if error_mm is not None else "missed",
        translation_error=None if error_mm is None else error_mm * 1e-3,
        rotation_error=None if error_mm is None else error_mm * 1e-2,
    )  # fmt: skip
    return Placement(**(values | changes))  # type: ignore[arg-type]


ERRORS = {"none": (4.0, 6.0, 20.0), "predicted": (1.0, 3.0, 2.0), "truth": (0.1, 0.2, 0.3)}


def some() -> list[Placement]:
    return [
        placement(part, 0, correction, value)  # type: ignore[arg-type]
        for correction, values in ERRORS.items()
        for part, value in zip("abc", values, strict=True)
    ]
