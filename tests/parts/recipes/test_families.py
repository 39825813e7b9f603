"""Some parts of every module of families, built for real: sound meshes, true hulls, PhysX' view of them."""

import csv
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.parts import Part, builtin_names, read_part
from mskgrasp.parts.builtin import recipe_of
from mskgrasp.parts.catalogue import Index
from mskgrasp.parts.commands.build_parts import build_parts
from mskgrasp.parts.recipes import families
from mskgrasp.parts.solids.measure import aspect_ratio

ONCE_A_FAMILY = {recipe_of(name).family: name for name in reversed(builtin_names())}


FAMILIES = int(os.environ.get("MSKGRASP_FAMILIES", "1"))
"""Of every module that draws parts, how many families are built; 99 for all."""


def some_of_every_module() -> list[str]:
    """A part each of some families of every module."""
    modules: dict[str, list[str]] = {}
    for name in sorted(ONCE_A_FAMILY.values()):
        modules.setdefault(recipe_of(name).make.__module__, []).append(name)
    return [name for names in modules.values() for name in names[-FAMILIES:]]


IN_PHYSX = """
import json, sys
from pathlib import Path
import sapien
if sys.argv[1] == "gpu":
    from sapien.pysapien.physx import _enable_gpu
    _enable_gpu()  # hulls are then cooked as for a GPU: 64 faces at most, and not too oblong
from mskgrasp.parts import read_part
scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
for folder in sys.stdin.read().split():
    part = read_part(Path(folder))
    builder = scene.create_actor_builder()
    builder.add_multiple_convex_collisions_from_file(str(part.hulls_path), scale=[1e-3] * 3)
    builder.set_mass_and_inertia(part.mass, sapien.Pose(q=part.quat_obj_principal), part.principal_inertia)
    body = builder.build(name=part.name).find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
    shapes = [(shape.vertices * shape.scale).tolist() for shape in body.collision_shapes]
    print(json.dumps([part.name, body.mass, body.inertia.tolist(), shapes]))
"""


@pytest.fixture(scope="module")
def family_parts(shared_cache: Path) -> dict[str, Part]:
    """By name, some of every module, made on both cores."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(shared_cache))
        names = some_of_every_module()
        built = list(build_parts(names, Index(parts={}, left_out={}), 2))
        assert [found.reason for found in built if found.entry is None] == []
        return {name: read_part(shared_cache / "mskgrasp" / "parts" / name) for name in names}


def test_every_module_with_recipes_is_listed():
    package = Path(families.__file__).parent
    modules = [path for path in package.glob("*.py") if path.name != "__init__.py"]
    found = [path.stem for path in modules if "\ndef recipes() ->" in path.read_text(encoding="utf-8")]
    assert sorted(found) == list(families.MODULES)


def hulls_of(part: Part) -> list[np.ndarray]:
    return [np.asarray(hull.vertices) for hull in trimesh.load_scene(part.hulls_path).dump()]


def test_there_are_hundreds_of_recipes_and_no_family_dominates():
    count = Counter(recipe_of(name).family for name in builtin_names())
    assert sum(count.values()) >= 1800 and len(count) >= 200
    assert max(count.values()) <= 0.2 * sum(count.values())
    light = [n for n in builtin_names() if ".families." in recipe_of(n).make.__module__]
    assert len(light) >= 1500


@pytest.mark.slow
def test_meshes_are_closed_single_bodies_about_their_centroid(family_parts):
    for part in family_parts.values():
        # As it is stored: trimesh would merge corners that lie nearer than it can tell apart in metres.
        mesh = trimesh.load_mesh(part.mesh_path, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1, part.name
        assert np.allclose(mesh.center_mass, 0, atol=2e-6), part.name
        assert part.mass == pytest.approx(part.density * mesh.volume, rel=1e-3), part.name
        assert 0.020 <= part.longest_axis <= 0.150, part.name


@pytest.mark.slow
def test_hulls_are_few_small_and_stout(family_parts):
    for part in family_parts.values():
        hulls = hulls_of(part)
        assert len(hulls) == part.n_hulls <= 48, part.name
        volume = sum(ConvexHull(points).volume for points in hulls)
        assert 1e-9 * volume == pytest.approx(part.hulls_volume, rel=1e-6), part.name
        for points in hulls:
            hull = ConvexHull(points)
            assert len(hull.vertices) == len(points) <= 32 and len(hull.simplices) <= 64, part.name
            assert aspect_ratio(points) <= 50, part.name


@pytest.mark.slow
def test_points_of_the_mesh_lie_in_the_hulls_and_points_far_outside_do_not(family_parts):
    """Independent of how the error is measured when a part is built: random points, counted."""
    for part in family_parts.values():
        mesh = trimesh.load_mesh(part.mesh_path)
        surface, _ = trimesh.sample.sample_surface(mesh, 1500, seed=0)
        planes = [ConvexHull(points).equations for points in hulls_of(part)]

        def inside(points: np.ndarray, slack_mm: float, planes: list[np.ndarray] = planes) -> np.ndarray:
            at_mm = points * 1000
            return np.any([(at_mm @ p[:, :3].T + p[:, 3]).max(axis=1) < slack_mm for p in planes], axis=0)

        assert inside(surface, 0.75).mean() > 0.94, part.name
        rng = np.random.default_rng(0)
        box = rng.uniform(mesh.bounds[0], mesh.bounds[1], (1500, 3))
        in_hulls = inside(box, 0.0).mean() * np.prod(mesh.extents)
        error = 3 * np.prod(mesh.extents) * np.sqrt(0.25 / len(box))
        assert abs(in_hulls - mesh.volume) < 0.11 * mesh.volume + error, part.name


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cpu", "gpu"])
def test_physx_takes_every_hull_as_it_is_and_mass_and_inertia_too(family_parts, kind):
    folders = " ".join(str(part.folder) for part in family_parts.values())
    done = subprocess.run(
        [sys.executable, "-c", IN_PHYSX, kind], input=folders, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "oblong" not in done.stderr + done.stdout
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("[")]
    assert len(lines) == len(family_parts)
    for name, mass, inertia, shapes in lines:
        part = family_parts[name]
        assert mass == pytest.approx(part.mass, rel=1e-5), name
        assert inertia == pytest.approx(part.principal_inertia, rel=1e-3), name
        stored = hulls_of(part)
        cooked = [ConvexHull(np.array(points) * 1e3) for points in shapes]
        assert len(cooked) == len(stored), name
        for corners in stored:
            # PhysX drops corners that hardly stand out; the order of the hulls is its own.
            off = min(float((corners @ c.equations[:, :3].T + c.equations[:, 3]).max()) for c in cooked)
            assert off < 0.03, name
        volume = sum(ConvexHull(corners).volume for corners in stored)
        assert sum(hull.volume for hull in cooked) == pytest.approx(volume, rel=2e-3), name


LEFT_OUT = {
    "beam_coupling_24x50", "beam_coupling_30x64", "beam_coupling_60x70", "cast_angle_45x40",
    "clamp_collar_42x22x15", "pipe_clamp_20x50", "spacer_block", "two_piece_collar_60x35x18",
    "two_piece_collar_76x48x20", "yoke_80x28", "yoke_90x40",
}  # fmt: skip
"""Recipes whose hulls are too far from the mesh, or whose part is another one's; the build says which."""


@pytest.mark.slow
def test_the_published_table_is_that_of_these_parts(family_parts):
    with open(Path(__file__).parents[3] / "docs" / "catalogue.csv", encoding="utf-8", newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert len(rows) >= 1011
    assert set(rows) | LEFT_OUT == set(builtin_names()) and not set(rows) & LEFT_OUT
    for name, part in family_parts.items():
        edges = [float(rows[name][f"edge_{number}_mm"]) for number in (1, 2, 3)]
        assert sorted(1e3 * part.extents) == pytest.approx(sorted(edges), abs=0.02), name
        assert 1e3 * part.mass == pytest.approx(float(rows[name]["mass_g"]), rel=2e-3, abs=0.06), name
        assert part.n_hulls == int(rows[name]["hulls"]), name
