"""Simulated settings that follow from the configuration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.settings import Physics
from mskgrasp.parts import find_part
from mskgrasp.runtime.options import parse
from mskgrasp.validate.config import (
    MOVED,
    NOMINAL,
    Reference,
    ValidateConfig,
    drawn_physics,
    floor_name,
    rounding_name,
)

REPOSITORY = Path(__file__).parents[2]


def settings_of(config: ValidateConfig):
    return {setting.name: setting for setting in config.settings()}


def test_every_reference_is_finer_than_production_whole_and_has_floors_of_its_own():
    config = ValidateConfig(grasps_per_part=10)
    settings = settings_of(config)
    for reference in config.references:
        own, floor = settings[reference.name], settings[floor_name(reference.name)]
        assert own.physics.rate_hz >= 2 * config.physics.rate_hz
        assert own.physics.position_iterations >= 2 * config.physics.position_iterations
        assert own.physics.coarse_rate_hz == own.physics.rate_hz and not own.physics.skip_air
        assert (floor.physics, floor.shift) == (own.physics, 1e-5) and floor.n <= own.n
    assert settings[rounding_name(config.references[0].name)].shift == 1e-7
    assert settings[MOVED].physics == settings[NOMINAL].physics == config.physics
    assert settings[config.references[1].name].n == 4 and settings[config.references[0].name].n == 10


def test_a_reference_that_is_not_finer_is_refused():
    for rate, iterations in ((1000, 100), (2000, 50)):
        with pytest.raises(ValueError, match="references must be finer"):
            ValidateConfig(
                references=(
                    Reference(
                        rate_hz=rate,
                        position_iterations=iterations,
                        grasps_per_part=1,
                        floor_grasps_per_part=1,
                    ),
                )
            )


def test_the_grid_holds_the_setting_under_test_once():
    config = ValidateConfig(
        rates_hz=(125, 250, 1000), iterations=(8, 50), physics=Physics(rate_hz=500, position_iterations=25)
    )
    candidates = config.candidates()
    assert {"250 Hz, 8 it", "1000 Hz, 50 it", "500 Hz, 25 it"} < set(candidates)
    assert not [name for name in candidates if name.startswith("125")]
    names = [setting.name for setting in config.settings()]
    assert len(names) == len(set(names)) and config.production not in names


def test_a_coarser_grid_is_coarse_throughout():
    assert ValidateConfig(physics=Physics()).at(125, 8).coarse_rate_hz == 125
    assert Physics(rate_hz=200).coarse_rate_hz == 200
    with pytest.raises(BadConfig, match="coarse_rate_hz is at most rate_hz, 200, got 250: lower it, too"):
        check_config(Physics, dict(rate_hz=200, coarse_rate_hz=250), "physics")


def test_the_default_validation_is_of_the_settings_that_are_the_default():
    config = read_config(ValidateConfig, REPOSITORY / "configs" / "validate" / "default.yaml")
    assert config.physics == Physics()
    assert min(find_part(name).mass for name in config.parts if name != "starter") < 0.003
    for name, (low, high) in config.ranges.items():
        assert low <= getattr(config.physics, name) <= high


def test_fingers_of_variants_are_critically_damped():
    config = read_config(ValidateConfig, REPOSITORY / "configs" / "validate" / "default.yaml")
    for setting in config.settings():
        physics = setting.physics
        critical = 2 * np.sqrt(physics.finger_stiffness * (physics.finger_armature + 0.015))
        assert physics.finger_damping == pytest.approx(critical, rel=0.01), setting.name


def test_variants_are_tried_beside_the_grid():
    config = ValidateConfig(
        variants={"pads": {"soft": {"pad_patch_radius": 0.008}}, "part": {"heavy": {"density": 2.0}}}
    )
    settings = settings_of(config)
    soft, heavy = settings["pads: soft"], settings["part: heavy"]
    assert soft.physics.pad_patch_radius == 0.008 and soft.physics.rate_hz == config.physics.rate_hz
    assert heavy.density == 2.0 and heavy.physics == config.physics


def test_variants_that_lift_faster_than_production_are_left_out_and_the_others_tried():
    file = REPOSITORY / "configs" / "validate" / "default.yaml"
    words = ["--config", str(file), "--physics.rate-hz", "500"]
    names = settings_of(parse(ValidateConfig, prog="p", description="d", argv=words))
    assert "engine: lift at 250 Hz" in names and "engine: lift at 1000 Hz" not in names
    assert "engine: lift at 1000 Hz" in settings_of(read_config(ValidateConfig, file))


def test_a_variant_of_a_lower_rate_lifts_no_faster():
    config = ValidateConfig(variants={"engine": {"slow": {"rate_hz": 250}}})
    (slow,) = (one for one in config.settings() if one.name == "engine: slow")
    assert slow.physics.coarse_rate_hz == slow.physics.rate_hz == 250


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rate_hz": 300, "coarse_rate_hz": 400}, "variants: 'group: typo': coarse_rate_hz is at most"),
        ({"pad_radius": 0.008}, "no setting of physics"),
        ({"hulls": "coarse"}, "hulls must be one of exact"),
        ({"rest": "drawing"}, "rest must be one of hulls, mesh"),
        ({"density": "half"}, "density must be a factor above 0, got 'half'"),
        ({"density": -1}, "density must be a factor above 0, got -1.0"),
        ({"density": True}, "density must be a factor above 0, got True"),
        (
            {"finger_force": 90.0},
            "variants: 'group: typo': 'finger_force': input should be less than .* 90.0$",
        ),
    ],
)
def test_variants_that_name_nothing_are_refused(values, message):
    with pytest.raises(BadConfig, match=message):
        check_config(ValidateConfig, {"variants": {"group": {"typo": values}}}, "file")


def test_a_rate_that_no_simulation_has_is_refused_by_the_name_of_its_option():
    with pytest.raises(ValidationError, match=r"rates_hz: 10 Hz: input should be greater than or equal to"):
        ValidateConfig(rates_hz=(10, 500))
    with pytest.raises(ValidationError, match=r"iterations: 2: input should be greater than or equal to 4"):
        ValidateConfig(iterations=(25, 2))


def test_empty_lists_are_refused():
    for name in ("rates_hz", "iterations", "references"):
        with pytest.raises(ValueError, match="at least one value"):
            ValidateConfig(**{name: ()})


@pytest.mark.parametrize(
    "ranges", [{"rate_hz": (500, 1000)}, {"skip_air": (0, 1)}, {"nothing": (0, 1)}, {"hold_s": (1, 0.5)}]
)
def test_ranges_of_what_cannot_be_drawn_are_refused(ranges):
    with pytest.raises(ValueError, match=f"ranges: {next(iter(ranges))} must be a real-valued setting"):
        ValidateConfig(ranges=ranges)


@pytest.mark.parametrize(
    ("name", "bounds", "got"),
    [
        ("finger_force", (30, 90), "90.0"),
        ("lift_height", (0, 0.1), "0.0"),
        ("finger_armature", (-1, 1), "-1.0"),
    ],
)
def test_ranges_beyond_what_physics_accepts_are_refused(name, bounds, got):
    with pytest.raises(BadConfig, match=f"ranges: '{name}': input should be .*, got {got}$"):
        check_config(ValidateConfig, {"ranges": {name: bounds}}, "file")


def test_a_range_that_would_be_ignored_is_refused():
    with pytest.raises(ValueError, match="finger_damping is not drawn, it stays critical"):
        ValidateConfig(ranges={"finger_damping": (50.0, 100.0)})


def test_a_table_without_friction_is_refused_where_parts_slide_on_it():
    with pytest.raises(ValueError, match="friction_table_part must be above 0"):
        ValidateConfig(physics=Physics(friction_table_part=0.0))
    ValidateConfig(physics=Physics(friction_table_part=0.0), engine="mujoco")


def test_pads_without_friction_are_refused():
    with pytest.raises(ValueError, match="friction_pad_part must be above 0"):
        ValidateConfig(physics=Physics(friction_pad_part=0.0))


def test_drawn_settings_lie_within_their_ranges_and_can_be_simulated():
    ranges = {
        "friction_pad_part": (0.3, 0.8),
        "friction_table_part": (0.3, 0.8),
        "finger_stiffness": (2e3, 64e3),
    }
    rng = np.random.default_rng(0)
    drawn = [drawn_physics(Physics(), ranges, rng) for _ in range(200)]
    for name, (low, high) in ranges.items():
        values = np.array([getattr(one, name) for one in drawn])
        assert low <= values.min() < values.max() <= high
        assert values.min() < low + 0.1 * (high - low) and values.max() > high - 0.1 * (high - low)
    for one in drawn:
        mass = one.finger_armature + 0.015
        assert one.finger_damping**2 == pytest.approx(4 * one.finger_stiffness * mass)


def test_the_error_of_a_label_is_measured_with_the_parts_and_ranges_of_the_default():
    configs = REPOSITORY / "configs" / "validate"
    whole, alone = (
        read_config(ValidateConfig, configs / f"{name}.yaml") for name in ("default", "label_error")
    )
    assert alone.ranges == whole.ranges and alone.parts == whole.parts
    assert alone.physics == whole.physics == Physics()
    assert alone.n_variants > whole.n_variants
