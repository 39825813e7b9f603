"""Validation passes where the simulation is right, and fails where it is wrong."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.settings import Physics
from mskgrasp.parts import find_part
from mskgrasp.validate.__main__ import main
from mskgrasp.validate.closed_form import Check, run_checks
from mskgrasp.validate.compare import cheapest, compare, complaints
from mskgrasp.validate.config import CELL_FLOOR, FLOOR, MOVED, REFERENCE, Setting, ValidateConfig
from mskgrasp.validate.convergence import Outcomes, draw_grasps, run_settings
from mskgrasp.validate.engines import complaints as complaints_of_engines
from mskgrasp.validate.engines import disagreements
from mskgrasp.validate.report import summarise_discards
from tests.programs import run_here

REPOSITORY = Path(__file__).parents[2]


def outcomes(n: int = 200, **changes: np.ndarray) -> Outcomes:
    """Made-up outcomes: half succeed, displacements of some millimetres."""
    rng = np.random.default_rng(5)
    success = np.arange(n) % 2 == 0
    displacement = np.where(success[:, None], rng.normal(0, 0.004, (n, 4)), np.nan)
    plain = Outcomes(
        success=success, failure=(~success).astype(int), displacement=displacement, tilt=np.zeros(n),
        penetration=np.zeros(n), fastest=np.full(n, 0.3), seconds=np.ones(n), cpu_seconds=np.full(n, 0.1),
        part=np.repeat("box", n),
    )  # fmt: skip
    return dataclasses.replace(plain, **changes)


def test_a_coarse_simulation_fails():
    reported: list[Check] = []
    coarse = Physics(rate_hz=100, position_iterations=4)
    checks = run_checks(coarse, reported.append)
    failed = [check.name for check in checks if not check.passed]
    assert "fall in 0.2 s" in failed and len(failed) >= 3
    assert reported == checks


def test_differences_are_those_that_were_put_in():
    before = outcomes()
    moved = before.displacement + np.array([0.003, 0.0, 0.004, 0.02])
    one = before.success.copy()
    one[:10] = ~one[:10]
    found = compare(
        dataclasses.replace(before, displacement=np.where(one[:, None], moved, np.nan), success=one), before
    )
    assert found.agreement == pytest.approx(0.95)
    assert found.n_both == 95
    assert found.shift_median == pytest.approx(0.005) and found.shift_p90 == pytest.approx(0.005)
    assert found.turn_median == pytest.approx(0.02)


def test_a_turn_over_half_a_circle_is_measured_the_short_way():
    before, after = outcomes(), outcomes()
    before.displacement[:, 3], after.displacement[:, 3] = np.pi - 0.01, -np.pi + 0.01
    assert compare(after, before).turn_median == pytest.approx(0.02)


def test_what_a_setting_adds_to_the_floor_is_listed():
    reference = outcomes()
    floor = compare(dataclasses.replace(reference, displacement=reference.displacement + 1e-4), reference)
    same = compare(reference, reference)
    assert complaints(same, floor, same.success_rate) == []
    shifted = compare(dataclasses.replace(reference, displacement=reference.displacement + 0.01), reference)
    said = complaints(shifted, floor, same.success_rate)
    assert any("shift median" in text for text in said) and any("distributed" in text for text in said)
    flipped = compare(dataclasses.replace(reference, success=~reference.success), reference)
    assert any("S agrees in 0.0%" in text for text in complaints(flipped, floor, same.success_rate))
    quick, slow = (dataclasses.replace(same, cpu_ms=ms) for ms in (40.0, 90.0))
    assert (
        cheapest({"bad": shifted, "slow": slow, "quick": quick}, floor, 0.5, ["bad", "slow", "quick"])
        == "quick"
    )
    assert cheapest({"bad": shifted}, floor, 0.5, ["bad"]) is None


def test_what_cannot_be_is_counted_by_reason():
    sick = outcomes()
    sick.penetration[3], sick.fastest[5], sick.displacement[8, 0] = 0.002, 4.0, 0.06
    found = summarise_discards(sick)
    assert found.dropped == {"penetrated": 1, "too_fast": 1, "moved_too_far": 1, "not_finite": 0}
    assert found.penetration == 0 and found.fastest == pytest.approx(0.3) and found.displaced < 0.05


def test_grasps_are_tried_once_and_read_afterwards(tmp_path):
    folders = [find_part("hex_nut_m20").folder]
    settings = [
        Setting(name="plain", physics=Physics()),
        Setting(name="moved", physics=Physics(), shift=1e-5),
        Setting(name="again", physics=Physics()),
    ]
    drawn = draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None)
    counts: list[int] = []
    first = run_settings(settings[:2], drawn, tmp_path, 2, counts.append)
    assert counts == [3, 3] and len(first["plain"].success) == 3
    times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")}
    second = run_settings(settings, drawn, tmp_path, 1, counts.append)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")} == times
    np.testing.assert_array_equal(first["plain"].displacement, second["again"].displacement)
    assert draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None) == drawn


def test_the_grid_holds_the_setting_under_test_and_the_floor():
    config = ValidateConfig(
        rates_hz=(250, 1000), iterations=(8, 50), physics=Physics(rate_hz=500, position_iterations=25)
    )
    settings = {setting.name: setting for setting in config.settings()}
    assert {"250 Hz, 8 it", "1000 Hz, 50 it", "500 Hz, 25 it"} < set(settings)
    assert settings[CELL_FLOOR].shift == 1e-4 and settings[CELL_FLOOR].physics == settings[FLOOR].physics
    assert settings[FLOOR].shift == 1e-5 and settings[FLOOR].physics == settings[REFERENCE].physics
    finest = settings[REFERENCE].physics
    assert finest.rate_hz == finest.coarse_rate_hz == 1000 and not finest.skip_air
    assert settings["1000 Hz, 50 it"].physics.coarse_rate_hz == Physics().coarse_rate_hz


def test_a_coarser_grid_is_coarse_throughout():
    assert ValidateConfig(physics=Physics()).at(125, 8).coarse_rate_hz == 125
    assert Physics(rate_hz=200).coarse_rate_hz == 200
    with pytest.raises(BadConfig, match="coarse_rate_hz is at most rate_hz, 200, got 250: lower it, too"):
        check_config(Physics, dict(rate_hz=200, coarse_rate_hz=250), "physics")


def test_the_default_validation_is_of_the_settings_that_are_the_default():
    config = read_config(ValidateConfig, REPOSITORY / "configs" / "validate" / "default.yaml")
    assert config.physics == Physics()
    assert min(find_part(name).mass for name in config.parts if name != "starter") < 0.003


def test_the_production_settings_pass_every_closed_form_check(tmp_path):
    done = validate("--no-convergence", "--parts", "hex_nut_m20", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "all checks passed"
    record = json.loads((tmp_path / "out" / "validate.json").read_text())
    assert record["failed"] == [] and len(record["closed_form"]) >= 13
    assert all(check["passed"] for check in record["closed_form"])
    assert record["parts"][0]["part"] == "hex_nut_m20" and record["parts"][0]["mass_error"] < 1e-4
    assert (tmp_path / "out" / "validate.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--parts", "no_such_part"], 2, "no_such_part"),
        (["--rates-hz", "50"], 2, "greater than or equal to 100"),
        (["--config", "no_such.yaml"], 2, "no_such.yaml"),
    ],
)
def test_mistakes_are_one_line(tmp_path, arguments, code, message):
    done = run_here(main, *arguments, "--out", str(tmp_path / "out"))
    assert done.returncode == code
    assert message in done.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_empty_lists_are_refused():
    with pytest.raises((BadConfig, ValueError), match="at least one value"):
        ValidateConfig(rates_hz=())


def validate(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mskgrasp.validate", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=REPOSITORY, timeout=300)


def test_without_successes_in_common_nothing_can_be_said():
    nothing = outcomes(success=np.zeros(200, bool), displacement=np.full((200, 4), np.nan))
    found = compare(nothing, nothing)
    assert any("only 0 grasps" in said for said in complaints(found, found, 0.0))
    assert found.as_dict()["shift_median"] is None
    assert cheapest({"it": found}, found, 0.0, ["it"]) is None


def test_a_bias_that_the_spread_hides_is_seen_in_pairs():
    before = outcomes(n=1200)
    noise = np.random.default_rng(0).normal(0, 1e-4, before.displacement.shape)
    biased = compare(
        dataclasses.replace(before, displacement=before.displacement + noise + [5e-4, 0, 0, 0]), before
    )
    assert biased.p_value > 0.05 and biased.bias_p < 1e-6
    assert biased.bias == pytest.approx(5e-4, rel=0.1)
    fair = compare(dataclasses.replace(before, displacement=before.displacement + noise), before)
    assert fair.bias < 2e-5 and fair.bias_p > 0.01


def test_variants_are_tried_beside_the_grid():
    config = ValidateConfig(variants={"soft pads": {"pad_patch_radius": 0.008}})
    tried = {setting.name: setting for setting in config.settings()}["soft pads"].physics
    assert tried.pad_patch_radius == 0.008 and tried.rate_hz == config.physics.rate_hz
    with pytest.raises(ValueError, match="no setting of physics"):
        ValidateConfig(variants={"typo": {"pad_radius": 0.008}})


def test_distributions_that_differ_by_less_than_can_be_noticed_are_the_same():
    """Most parts do not rise in the hand: dz is nearly one number, and any shift of it is significant."""
    still = outcomes(n=1200)
    still.displacement[:, 2] = np.where(still.success, np.random.default_rng(1).normal(0, 1e-6, 1200), np.nan)
    for shift, same in ((2e-5, True), (2e-4, False)):
        moved = still.displacement + np.array([0, 0, shift, 0])
        found = compare(dataclasses.replace(still, displacement=moved), still)
        assert (found.p_beyond > 0.05) == same and found.p_value < 0.05


def test_engines_that_differ_are_reported_with_the_kinds_of_disagreement():
    one = outcomes()
    one = dataclasses.replace(one, failure=np.where(one.success, 0, 1))
    assert complaints_of_engines(compare(one, one)) == []
    success = one.success.copy()
    success[:20] = ~success[:20]
    moved = np.where(success[:, None], np.nan_to_num(one.displacement) + 0.001, np.nan)
    other = dataclasses.replace(one, success=success, displacement=moved, failure=np.where(success, 0, 2))
    assert [said.split()[0] for said in complaints_of_engines(compare(other, one))] == ["S", "displacements"]
    assert sorted(disagreements(other, one)) == [(("held", "missed"), 10), (("slipped", "held"), 10)]


def test_both_engines_try_the_same_grasps(tmp_path: Path):
    done = run_here(
        main, "--engine", "mujoco", "--parts", "hex_nut_m30", "--grasps-per-part", "6", "--workers", "1",
        "--out", str(tmp_path),
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    record = json.loads((tmp_path / "engines.json").read_text())
    found = record["engines"]
    assert found["hex_nut_m30"] == found["all"] and found["all"]["n"] == 6
    assert found["all"]["agreement"] >= 0.6 and found[f"mujoco{MOVED}"]["shift_median"] < 1e-3
    assert "mujoco" in record["versions"]
