"""Built-in families of parts, one module for each kind of construction."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.recipes.recipe import Recipe

MODULES = (
    "angles",
    "bends",
    "brackets",
    "couplings",
    "cranks",
    "devices",
    "eyes",
    "fasteners",
    "fittings",
    "fixtures",
    "gears",
    "grips",
    "handles",
    "hinges",
    "joints",
    "nuts",
    "pins",
    "pipe",
    "plates",
    "profiles",
    "pulleys",
    "racks",
    "rings",
    "screws",
    "shafts",
    "studs",
    "supports",
)
"""The modules of families in this package; each has a function ``recipes``."""

STARTER = (
    "bearing_6202",
    "bearing_6205",
    "bushing_20x26x30",
    "clevis_pin_16x80",
    "hex_bolt_m12x60",
    "hex_bolt_m20x50",
    "hex_nut_m20",
    "hex_nut_m30",
    "hinge_60x30",
    "l_bracket_40x40",
    "l_bracket_60x40",
    "parallel_key_a16x10x56",
    "parallel_key_b20x12x80",
    "parallel_pin_12x60",
    "parallel_pin_20x100",
    "pillow_block_80x32",
    "shaft_collar_25",
    "socket_screw_m10x60",
    "socket_screw_m16x50",
    "spur_gear_m2_z18",
    "spur_gear_m3_z17",
    "stepped_shaft_28x95",
    "t_nut_m16x18",
    "u_bracket_60x35",
    "washer_m36",
)
"""The starter set: 25 parts of 17 families that are built in a few seconds; the demo uses them."""


@lru_cache(maxsize=1)
def recipes() -> dict[str, Recipe]:
    """All built-in parts by name, sorted."""
    found: dict[str, Recipe] = {}
    for module in MODULES:
        for recipe in import_module(f"{__name__}.{module}").recipes():
            if recipe.name in found:
                raise BadPart(f"two recipes are called {recipe.name!r}: rename one")
            found[recipe.name] = recipe
    return dict(sorted(found.items()))
