"""Long parts: keys, pins, a stepped shaft."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families.listing import OWN, one, one_per_row
from mskgrasp.parts.recipes.recipe import Recipe, table, table_row
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

DIN_6885_LENGTHS = {  # by width: a short and a long one of the preferred lengths for each form
    ("a", 10): (70, 100),
    ("a", 12): (63, 125),
    ("a", 14): (80, 140),
    ("a", 16): (110,),
    ("a", 18): (70, 90),
    ("a", 20): (63, 125),
    ("a", 22): (70, 100),
    ("a", 25): (80, 110),
    ("a", 28): (90, 140),
    ("b", 8): (56, 80),
    ("b", 12): (45, 90),
    ("b", 16): (63, 100),
    ("b", 18): (56, 125),
    ("b", 22): (80,),
    ("b", 25): (70, 140),
    ("b", 28): (100,),
    ("b", 32): (90, 125),
}
ISO_2338_LENGTHS = {
    8: (70,),
    10: (80, 95),
    12: (120,),
    16: (55, 85, 140),
    20: (40, 75),
    25: (60, 100),
    30: (80, 140),
}
ISO_2341_LENGTHS = {8: (60,), 10: (80,), 12: (50, 100), 14: (70,), 16: (120,), 18: (55, 90), 20: (70, 140)}
ISO_2341_B_LENGTHS = {12: (75,), 16: (60, 100), 20: (90,), 22: (60, 120), 24: (80,), 30: (100,)}


def recipes() -> Iterator[Recipe]:
    """The built-in keys, pins and stepped shafts."""
    row = table_row("din6885_parallel_key.csv", b_mm=16) | {"l_mm": 56.0}
    yield one(row, "parallel_key_a{b}x{h}x{l}", key_form_a, source="DIN 6885-1 form A", family="parallel_key")
    row = table_row("din6885_parallel_key.csv", b_mm=20) | {"l_mm": 80.0}
    yield one(row, "parallel_key_b{b}x{h}x{l}", key_form_b, source="DIN 6885-1 form B", family="parallel_key")
    for d, length in ((12, 60), (20, 100)):
        row = table_row("iso2338_parallel_pin.csv", d_mm=d) | {"l_mm": float(length)}
        yield one(row, "parallel_pin_{d}x{l}", parallel_pin, source="ISO 2338")
    row = table_row("iso2341_clevis_pin.csv", d_mm=16) | {"l_mm": 80.0}
    yield one(row, "clevis_pin_{d}x{l}", clevis_pin, source="ISO 2341")
    row = table("stepped_shaft.csv")[0]
    yield one(row, "stepped_shaft_28x95", stepped_shaft)
    for (form, b), lengths in DIN_6885_LENGTHS.items():
        make = key_form_a if form == "a" else key_form_b
        for length in lengths:
            row = table_row("din6885_parallel_key.csv", b_mm=b) | {"l_mm": float(length)}
            source = f"DIN 6885-1 form {form.upper()}"
            yield one(
                row, f"parallel_key_{form}{{b}}x{{h}}x{{l}}", make, source=source, family="parallel_key"
            )
    for lengths, file_name, name, make, source in (
        (ISO_2338_LENGTHS, "iso2338_parallel_pin.csv", "parallel_pin_{d}x{l}", parallel_pin, "ISO 2338"),
        (ISO_2341_LENGTHS, "iso2341_clevis_pin.csv", "clevis_pin_{d}x{l}", clevis_pin, "ISO 2341"),
        (
            ISO_2341_B_LENGTHS,
            "iso2341_form_b.csv",
            "clevis_pin_b{d}x{l}",
            clevis_pin_form_b,
            "ISO 2341 form B",
        ),
    ):
        for d, choice in lengths.items():
            for length in choice:
                row = table_row(file_name, d_mm=d) | {"l_mm": float(length)}
                family = "clevis_pin" if "clevis" in name else ""
                yield one(row, name, make, source=source, family=family)
    for file_name, name, make, source in (
        ("din6885_form_c.csv", "screwed_key_{b}x{h}x{l}", screwed_key, "DIN 6885-1; own holes"),
        ("din6887_gib_key.csv", "gib_key_{b}x{h}x{l}", gib_key, "DIN 6887; own length of the head"),
        ("iso3912_woodruff_key.csv", "woodruff_key_{b}x{h}", woodruff_key, "ISO 3912"),
        ("iso2339_taper_pin.csv", "taper_pin_{d}x{l}", taper_pin, "ISO 2339"),
        ("locating_pin.csv", "locating_pin_{d2}x{l}", locating_pin, OWN),
        ("grooved_pin.csv", "grooved_pin_{d}x{l}", grooved_pin, OWN),
        ("index_plunger.csv", "index_plunger_{d}x{l}", index_plunger, OWN),
    ):
        yield from one_per_row(file_name, name, make, source=source)


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


def screwed_key(size: dict[str, float]) -> s.Solid:
    """A key with round ends and the counterbored holes of two holding screws, which hulls fill."""
    key = key_form_a(size)
    body = s.extrude(_obround(size["b_mm"] / 2, size["l_mm"], s.CIRCLE_SEGMENTS // 2, 1.0), 0, size["h_mm"])
    for x in (-size["apart_mm"] / 2, size["apart_mm"] / 2):
        body = body - s.drill(size["hole_mm"] / 2, (x, 0, -1), "z", size["h_mm"] + 2)
        body = body - s.drill(size["head_mm"] / 2, (x, 0, size["h_mm"] - size["deep_mm"]), "z", 20)
    return s.solid(body, key.hulls)


def gib_key(size: dict[str, float]) -> s.Solid:
    """A key along x whose top falls by 1:100 from its head."""
    b, h, high, head, end = size["b_mm"] / 2, size["h_mm"], size["h1_mm"], size["head_mm"], size["l_mm"]
    corners = [(0, 0), (end, 0), (end, h - (end - head) / 100), (head, h), (head, high - 2), (head - 2, high)]
    outline = np.array([*corners, (0, high)], dtype=float)
    return sh.plate(outline, -b, b).turned("x", 90).solid()


def woodruff_key(size: dict[str, float]) -> s.Solid:
    """A segment of a disc."""
    b, h, r = size["b_mm"], size["h_mm"], size["d_mm"] / 2
    outlines = []
    for segments in (s.CIRCLE_SEGMENTS // 2, 13):
        half = np.arccos((r - h) / r)
        angle = np.linspace(-half, half, segments + 1)
        outlines.append(r * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1))
    return s.solid(s.extrude(outlines[0], 0, b), [s.prism(outlines[1], 0, b)])


def parallel_pin(size: dict[str, float]) -> s.Solid:
    """A pin with both ends chamfered by 15 degrees."""
    r, c, length = size["d_mm"] / 2, size["c_mm"], size["l_mm"]
    tip = r - c * np.tan(np.radians(15))
    body = s.lathe([(0, 0), (tip, 0), (r, c), (r, length - c), (tip, length), (0, length)])
    hulls = [s.frustum(tip, r, 0, c), *s.rod(r, c, length - c), s.frustum(r, tip, length - c, length)]
    return s.solid(body, hulls)


def taper_pin(size: dict[str, float]) -> s.Solid:
    """A pin with a taper of 1:50; the nominal diameter is that of its small end."""
    small, length = size["d_mm"] / 2, size["l_mm"]
    large, a = small + length / 100, size["a_mm"]
    return sh.turned(
        [(0, 0), (0.8 * small, 0), (small, a), (large, length - a), (0.8 * large, length), (0, length)]
    ).solid()


def clevis_pin(size: dict[str, float]) -> s.Solid:
    """Head below z = 0, shank above with a chamfered end."""
    r, head, k, length = size["d_mm"] / 2, size["dk_mm"] / 2, size["k_mm"], size["l_mm"]
    c = 0.1 * size["d_mm"]
    body = s.lathe([(0, -k), (head, -k), (head, 0), (r, 0), (r, length - c), (r - c, length), (0, length)])
    hulls = [*s.rod(head, -k, 0), *s.rod(r, 0, length - c), s.frustum(r, r - c, length - c, length)]
    return s.solid(body, hulls)


def clevis_pin_form_b(size: dict[str, float]) -> s.Solid:
    """A clevis pin with the hole of a split pin across its end, which hulls fill."""
    r, head, k, length = size["d_mm"] / 2, size["dk_mm"] / 2, size["k_mm"], size["l_mm"]
    c = 0.1 * size["d_mm"]
    pin = sh.turned([(0, -k), (head, -k), (head, 0), (r, 0), (r, length - c), (r - c, length), (0, length)])
    hole = s.drill(size["d1_mm"] / 2, (-r - 1, 0, length - size["le_mm"]), "x", 2 * r + 2)
    return pin.drilled(hole).solid()


def locating_pin(size: dict[str, float]) -> s.Solid:
    """A shank, a collar, a locating diameter with a cone on top."""
    shank, collar, r = size["d1_mm"] / 2, size["dc_mm"] / 2, size["d2_mm"] / 2
    z = np.cumsum([size["l1_mm"], size["lc_mm"], size["l2_mm"]])
    top, tip = size["l_mm"], 0.4 * r
    corners = [(0, 0), (shank - 1, 0), (shank, 1), (shank, z[0]), (collar, z[0]), (collar, z[1])]
    corners += [(r, z[1]), (r, z[2]), (tip, top), (0, top)]
    return sh.turned([(float(x), float(y)) for x, y in corners]).solid()


def grooved_pin(size: dict[str, float]) -> s.Solid:
    """A bolt with a head, a groove for a lock plate near its end, and a domed end."""
    r, head, k, top = size["d_mm"] / 2, size["dk_mm"] / 2, size["k_mm"], size["l_mm"]
    m, floor, z = size["m_mm"], size["d2_mm"] / 2, size["l_mm"] - size["inset_mm"]
    profile = [(0, -k), (head - 1, -k), (head, 1 - k), (head, 0), (r, 0), (r, z - m), (floor, z - m)]
    return sh.turned([*profile, (floor, z), (r, z), (r, top - 0.2 * r), (0.6 * r, top), (0, top)]).solid()


def index_plunger(size: dict[str, float]) -> s.Solid:
    """A threaded sleeve with a hexagon, its pin below, the pull knob above."""
    thread, pin, knob = size["D_mm"] / 2, size["d_mm"] / 2, size["knob_mm"] / 2
    z = np.cumsum([size["pin_mm"], size["thread_mm"], size["hex_mm"], size["neck_mm"]])
    top = size["l_mm"]
    corners = [(0, 0), (pin - 0.8, 0), (pin, 0.8), (pin, z[0]), (thread, z[0]), (thread, z[1])]
    corners += [(0.55 * knob, z[1]), (0.55 * knob, z[3]), (knob - 1, z[3]), (knob, z[3] + 1)]
    corners += [(knob, top - 4), (0.7 * knob, top), (0, top)]
    body = sh.turned([(float(x), float(y)) for x, y in corners])
    return (body + sh.hexagon_bar(size["s_mm"], z[1], z[2])).solid()


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
