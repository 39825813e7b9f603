"""Parts in the engine against their meshes."""

from __future__ import annotations

import dataclasses
import json

import pytest

from mskgrasp.parts import find_part
from mskgrasp.validate.body_scene import BodyScene, Workshop
from mskgrasp.validate.fidelity import Fidelity, check_parts


def test_a_box_is_in_the_engine_what_its_mesh_is_and_a_part_of_the_catalogue_within_the_bounds(
    scene: BodyScene, workshop: Workshop
):
    seen: list[int] = []
    nut = find_part("hex_nut_m20")
    box, other = check_parts(scene, [workshop.block(), nut], lambda: seen.append(1))
    assert len(seen) == 2 and box.passed and other.passed
    assert (box.part, box.hulls) == ("block", 1) and box.surface_p95 < 1e-6
    assert box.volume_ratio == pytest.approx(1.0, abs=1e-4) and box.mass_error < 1e-5
    assert (other.part, other.hulls) == ("hex_nut_m20", nut.n_hulls)


def test_a_mass_that_is_not_density_times_volume_is_noticed(scene: BodyScene, workshop: Workshop):
    block = workshop.block()
    (found,) = check_parts(scene, [dataclasses.replace(block, density=2 * block.density)], lambda: None)
    assert found.mass_error == pytest.approx(0.5, abs=1e-4) and found.inertia_error > 0.4
    assert not found.passed


@pytest.mark.parametrize(
    ("changes", "passed"),
    [
        (dict(), True), (dict(surface_p95=0.1), False), (dict(volume_ratio=0.1), False),
        (dict(volume_ratio=10.0), False), (dict(mass_error=0.01), False), (dict(inertia_error=0.1), False),
        (dict(mass_error=float("nan")), False),
    ],
)  # fmt: skip
def test_every_error_counts(changes: dict[str, float], passed: bool):
    good = dict(surface_p95=1e-5, volume_ratio=1.0, mass_error=1e-6, inertia_error=1e-3)
    one = Fidelity(part="nut", hulls=3, **(good | changes))
    assert one.passed is passed and json.loads(json.dumps(one.to_json()))["passed"] is passed
