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


VARIANT_OF = {
    "button_flange_screw": "button_screw",
    "chamfered_washer": "washer",
    "coupling_nut": "hex_nut",
    "fine_timing_pulley": "timing_pulley",
    "flanged_linear_bearing": "linear_bearing",
    "heavy_flange_bolt": "flange_bolt",
    "high_nut": "hex_nut",
    "inch_pan_screw": "pan_head_screw",
    "inch_socket_screw": "socket_screw",
    "l_bolt": "j_bolt",
    "large_washer": "washer",
    "lobular_cheese_screw": "cheese_head_screw",
    "lobular_pan_screw": "pan_head_screw",
    "long_t_nut": "t_nut",
    "low_profile_screw": "socket_screw",
    "pan_washer_screw": "pan_head_screw",
    "pipe_turnbuckle": "turnbuckle",
    "raised_cheese_screw": "cheese_head_screw",
    "raised_countersunk_screw": "countersunk_screw",
    "slotted_countersunk_screw": "countersunk_screw",
    "spherical_bearing": "bearing",
    "spoked_gear": "spur_gear",
    "square_u_bolt": "u_bolt",
    "standoff_mf": "standoff_ff",
    "thick_washer": "washer",
    "thin_nut": "hex_nut",
    "two_piece_collar": "clamp_collar",
    "u_bolt_nuts": "u_bolt",
    "webbed_gear": "spur_gear",
}
"""Families that are variants of another one: they are on its side of the split."""


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
