"""The built-in parts: sound meshes, true masses, hulls that PhysX takes as they are."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.parts import Part, starter_names
from mskgrasp.parts.recipes.families import recipes
from mskgrasp.parts.recipes.recipe import TABLES, table
from mskgrasp.parts.solids.measure import aspect_ratio
from mskgrasp.parts.store import read_record

STEEL, BRONZE = 7850.0, 8800.0


def hulls_of(part: Part) -> list[np.ndarray]:
    return [np.asarray(hull.vertices) for hull in trimesh.load_scene(part.hulls_path).dump()]


@pytest.mark.slow
def test_there_are_at_least_16_parts_of_10_families_and_none_dominates(builtin_parts):
    families = [part.family for part in builtin_parts.values()]
    assert len(families) >= 16
    assert len(set(families)) >= 10
    assert max(families.count(family) for family in families) <= 3


def test_names_are_sorted_and_fit_for_a_folder():
    names = starter_names()
    assert list(names) == sorted(set(names))
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789_-") for name in names)


@pytest.mark.slow
def test_parts_are_20_to_150_mm_long_and_can_be_gripped(builtin_parts):
    for part in builtin_parts.values():
        assert 0.020 <= part.longest_axis <= 0.150, part.name
        assert np.sort(part.extents)[1] <= 0.075, part.name
    assert sum(part.extents.min() < 0.004 for part in builtin_parts.values()) <= 2


def test_meshes_are_closed_single_bodies_with_the_centroid_at_the_origin(builtin_parts):
    for part in builtin_parts.values():
        mesh = trimesh.load_mesh(part.mesh_path)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1, part.name
        assert mesh.volume > 0
        assert np.allclose(mesh.center_mass, 0, atol=1e-7), part.name
        assert np.allclose(mesh.extents, part.extents, atol=1e-7), part.name


def test_hulls_are_convex_small_and_not_too_slender_for_physx(builtin_parts):
    for part in builtin_parts.values():
        hulls = hulls_of(part)
        assert len(hulls) == part.n_hulls <= 48, part.name
        for points in hulls:
            hull = ConvexHull(points)
            assert len(hull.vertices) == len(points) <= 32, part.name
            assert len(hull.simplices) <= 64, part.name
            assert aspect_ratio(points) <= 50, part.name


def test_hulls_stay_within_a_millimetre_of_the_mesh_unless_holes_are_filled(builtin_parts):
    for part in builtin_parts.values():
        filled = part.dimensions["hole"] / 2 if part.family == "hinge" else 0.0
        assert part.hull_error <= max(0.00075, filled), part.name
        record = read_record(part.folder)
        assert record["hull_error_p95"] <= part.hull_error
        assert 0.98 <= record["hull_volume_ratio"] <= 1.05, part.name


def test_hulls_enclose_the_part_as_the_mesh_does(builtin_parts):
    for part in builtin_parts.values():
        points = np.concatenate(hulls_of(part)) / 1000
        assert np.allclose(points.max(axis=0) - points.min(axis=0), part.extents, atol=1e-3), part.name


def test_sapien_loads_every_hull_where_it_should_be(builtin_parts):
    sapien = pytest.importorskip("sapien")
    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    for part in builtin_parts.values():
        builder = scene.create_actor_builder()
        builder.add_multiple_convex_collisions_from_file(str(part.hulls_path), scale=[1e-3] * 3)
        builder.set_mass_and_inertia(part.mass, sapien.Pose(), part.principal_inertia)
        body = builder.build(name=part.name).find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
        assert len(body.collision_shapes) == part.n_hulls, part.name
        stored = hulls_of(part)
        for shape in body.collision_shapes:
            cooked = shape.vertices * shape.scale * 1000
            same = [points for points in stored if len(points) == len(cooked)]
            distances = [
                np.linalg.norm(cooked[:, None] - points[None], axis=2).min(axis=1) for points in same
            ]
            closest = int(np.argmin([distance.max() for distance in distances]))
            assert distances[closest].max() < 1e-3, part.name
            stored = [points for points in stored if points is not same[closest]]
        assert stored == [], part.name


def test_a_key_weighs_and_turns_like_a_box(builtin_parts):
    part = builtin_parts["parallel_key_b20x12x80"]
    x, y, z = 0.080, 0.020, 0.012
    mass = STEEL * x * y * z
    assert part.mass == pytest.approx(mass, rel=1e-6)
    expected = mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    assert np.allclose(part.inertia, expected, rtol=1e-6, atol=1e-12)


def test_a_bushing_weighs_and_turns_like_a_tube(builtin_parts):
    part = builtin_parts["bushing_20x26x30"]
    inner, outer, length = 0.010, 0.013, 0.030
    mass = BRONZE * math.pi * (outer**2 - inner**2) * length
    assert part.mass == pytest.approx(mass, rel=1e-3)
    axial = mass / 2 * (outer**2 + inner**2)
    across = mass / 12 * (3 * (outer**2 + inner**2) + length**2)
    assert np.allclose(np.diag(part.inertia), [across, across, axial], rtol=2e-3)


def test_a_pin_weighs_like_a_cylinder_with_two_cones_cut_to_it(builtin_parts):
    part = builtin_parts["parallel_pin_20x100"]
    r, c, length = 0.010, 0.0035, 0.100
    tip = r - c * math.tan(math.radians(15))
    volume = math.pi * r * r * (length - 2 * c) + 2 * math.pi * c / 3 * (r * r + r * tip + tip * tip)
    assert part.mass == pytest.approx(STEEL * volume, rel=1e-3)


def test_a_bolt_weighs_like_its_head_and_shank(builtin_parts):
    part = builtin_parts["hex_bolt_m12x60"]
    head, shank = math.sqrt(3) / 2 * 0.018**2 * 0.0075, math.pi * 0.006**2 * 0.060
    assert part.mass == pytest.approx(STEEL * (head + shank), rel=0.02)  # chamfers take the rest


def test_a_bearing_weighs_about_what_catalogues_say(builtin_parts):
    assert builtin_parts["bearing_6205"].mass == pytest.approx(0.128, rel=0.05)
    assert builtin_parts["bearing_6202"].mass == pytest.approx(0.045, rel=0.05)


def test_principal_axes_are_right_handed_and_diagonalise_the_inertia(builtin_parts):
    for part in builtin_parts.values():
        axes = quat_to_matrix(part.quat_obj_principal)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        rebuilt = axes @ np.diag(part.principal_inertia) @ axes.T
        assert np.allclose(rebuilt, part.inertia, atol=1e-6 * part.inertia.max()), part.name
        a, b, c = np.sort(part.principal_inertia)
        assert 0 < a and c <= a + b


def test_a_gear_has_its_teeth_at_the_tip_circle(builtin_parts):
    part = builtin_parts["spur_gear_m3_z17"]
    points = trimesh.load_mesh(part.mesh_path).vertices
    radius = np.hypot(points[:, 0], points[:, 1])
    assert radius.max() == pytest.approx(0.003 * (17 + 2) / 2, rel=1e-4)
    angles = np.sort(np.arctan2(points[:, 1], points[:, 0])[radius > 0.9999 * radius.max()])
    tips = np.count_nonzero(np.diff(angles) > 0.5 * 2 * np.pi / 17) + 1
    assert tips == 17


def test_tables_name_their_standard_and_explain_every_column():
    files = sorted(Path(TABLES).glob("*.csv"))
    assert len(files) >= 10
    for path in files:
        lines = path.read_text(encoding="utf-8").splitlines()
        comments = " ".join(line for line in lines if line.startswith("#"))
        header = next(csv.reader(line for line in lines if not line.startswith("#")))
        assert "millimetres" in comments or path.name.startswith("iso54"), path.name
        assert all(column in comments for column in header), path.name
        assert table(path.name), path.name


def test_built_lengths_are_lengths_of_the_standard():
    for recipe in recipes().values():
        if "l_min_mm" in recipe.dimensions:
            low, high = recipe.dimensions["l_min_mm"], recipe.dimensions["l_max_mm"]
            assert low <= recipe.dimensions["l_mm"] <= high, recipe.name


def test_dimensions_are_stored_in_metres_and_counts_as_they_are(builtin_parts):
    assert builtin_parts["hex_nut_m30"].dimensions["s"] == pytest.approx(0.046)
    assert builtin_parts["spur_gear_m2_z18"].dimensions["teeth"] == 18
