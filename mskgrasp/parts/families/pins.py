"""Long parts: parallel keys and pins, clevis pins, a stepped shaft."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts import solid as s
from mskgrasp.parts.families.recipe import STEEL, Recipe, table, table_row


def recipes() -> Iterator[Recipe]:
    """The built-in keys, pins and shafts."""
    row = table_row("din6885_parallel_key.csv", b_mm=16) | {"l_mm": 56.0}
    yield _recipe("parallel_key_a16x10x56", "parallel_key", "DIN 6885-1 form A", row, key_form_a)
    row = table_row("din6885_parallel_key.csv", b_mm=20) | {"l_mm": 80.0}
    yield _recipe("parallel_key_b20x12x80", "parallel_key", "DIN 6885-1 form B", row, key_form_b)
    for d, length in ((12, 60), (20, 100)):
        row = table_row("iso2338_parallel_pin.csv", d_mm=d) | {"l_mm": float(length)}
        yield _recipe(f"parallel_pin_{d}x{length}", "parallel_pin", "ISO 2338", row, parallel_pin)
    row = table_row("iso2341_clevis_pin.csv", d_mm=16) | {"l_mm": 80.0}
    yield _recipe("clevis_pin_16x80", "clevis_pin", "ISO 2341", row, clevis_pin)
    row = table("stepped_shaft.csv")[0]
    yield _recipe("stepped_shaft_28x95", "stepped_shaft", "own dimensions", row, stepped_shaft)


def _recipe(name: str, family: str, source: str, dimensions: dict[str, float], make: s.Maker) -> Recipe:
    return Recipe(name=name, family=family, source=source, density=STEEL, dimensions=dimensions, make=make)


def key_form_a(size: dict[str, float]) -> s.Solid:
    """A key with round ends."""
    b, h, length = size["b_mm"], size["h_mm"], size["l_mm"]
    return s.solid(
        s.extrude(_obround(b / 2, length, s.CIRCLE_SEGMENTS // 2, 1.0), 0, h),
        [s.prism(_obround(b / 2, length, 7, 2 / (1 + np.cos(np.pi / 14))), 0, h)],
    )


def key_form_b(size: dict[str, float]) -> s.Solid:
    """A key with square ends."""
    b, h, length = size["b_mm"], size["h_mm"], size["l_mm"]
    outline = s.rectangle(-length / 2, length / 2, -b / 2, b / 2)
    return s.solid(s.extrude(outline, 0, h), [s.prism(outline, 0, h)])


def parallel_pin(size: dict[str, float]) -> s.Solid:
    """A pin with both ends chamfered by 15 degrees."""
    r, c, length = size["d_mm"] / 2, size["c_mm"], size["l_mm"]
    tip = r - c * np.tan(np.radians(15))
    body = s.lathe([(0, 0), (tip, 0), (r, c), (r, length - c), (tip, length), (0, length)])
    hulls = [s.frustum(tip, r, 0, c), *s.rod(r, c, length - c), s.frustum(r, tip, length - c, length)]
    return s.solid(body, hulls)


def clevis_pin(size: dict[str, float]) -> s.Solid:
    """Head below z = 0, shank above with a chamfered end."""
    r, head, k, length = size["d_mm"] / 2, size["dk_mm"] / 2, size["k_mm"], size["l_mm"]
    c = 0.1 * size["d_mm"]
    body = s.lathe([(0, -k), (head, -k), (head, 0), (r, 0), (r, length - c), (r - c, length), (0, length)])
    hulls = [*s.rod(head, -k, 0), *s.rod(r, 0, length - c), s.frustum(r, r - c, length - c, length)]
    return s.solid(body, hulls)


def stepped_shaft(size: dict[str, float]) -> s.Solid:
    """Two seats with a shoulder between them."""
    ends = np.cumsum([0.0, size["l1_mm"], size["l2_mm"], size["l3_mm"]])
    profile, hulls = [(0.0, 0.0)], []
    for radius, z0, z1 in zip(
        (size["d1_mm"] / 2, size["d2_mm"] / 2, size["d3_mm"] / 2), ends[:-1], ends[1:], strict=True
    ):
        profile += [(radius, float(z0)), (radius, float(z1))]
        hulls += s.rod(radius, z0, z1)
    return s.solid(s.lathe([*profile, (0.0, float(ends[-1]))]), hulls)


def _obround(radius: float, length: float, segments: int, swell: float) -> np.ndarray:
    """A rectangle along x with round ends of so many segments; ``swell`` moves the corners of the arcs out.

    The corners where arc and flank meet stay on the flank, so that the width is exact.
    """
    angle = np.linspace(-np.pi / 2, np.pi / 2, segments + 1)
    reach = np.full(segments + 1, radius * swell)
    reach[[0, -1]] = radius
    arc = np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1) + [length / 2 - radius, 0.0]
    return np.concatenate([arc, -arc])
