"""A solid as a part: where its frame is, and which hulls are refused."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import Part
from mskgrasp.parts.recipes.families import recipes
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.store import read_part
from mskgrasp.parts.write_solid import MANY_HULLS, with_hulls, write_solid


def written(solid: Solid, coarse: bool = False) -> Part:
    return write_solid(
        solid, name="one", family="test", source="own", licence="CC0-1.0", density=1000.0, dimensions={},
        recipe_hash="0", coarse=coarse,
    )  # fmt: skip


def box(size_mm: tuple[float, float, float], centre_mm: tuple[float, float, float] = (0, 0, 0)) -> Solid:
    mesh = trimesh.creation.box(size_mm)
    mesh.apply_translation(centre_mm)
    return Solid(mesh=mesh, hulls=(np.array(mesh.vertices),))


def test_the_frame_of_a_part_is_at_its_centroid_with_the_axes_of_the_mesh():
    part = written(box((60, 40, 20), centre_mm=(100, -50, 7)))
    assert np.allclose(part.extents, [0.06, 0.04, 0.02])
    for path, unit in ((part.mesh_path, 1.0), (part.hulls_path, 1e-3)):
        corners = np.asarray(trimesh.load_scene(path).to_geometry().vertices) * unit
        assert np.allclose(corners.min(axis=0), [-0.03, -0.02, -0.01], atol=1e-8)
        assert np.allclose(corners.max(axis=0), [0.03, 0.02, 0.01], atol=1e-8)
    assert part.mass == pytest.approx(0.048)
    assert read_part(part.folder).content_hash == part.content_hash


def test_many_hulls_of_a_family_are_joined_and_few_are_kept():
    slices = [box((2, 40, 20), centre_mm=(2 * k + 1, 0, 0)).hulls[0] for k in range(MANY_HULLS + 1)]
    long = Solid(mesh=box((2 * len(slices), 40, 20), centre_mm=(len(slices), 0, 0)).mesh, hulls=tuple(slices))
    assert len(with_hulls(long).hulls) == 1
    few = box((60, 40, 20))
    assert with_hulls(few) is few


def test_hulls_that_are_not_the_part_are_refused_with_both_numbers():
    recipe = recipes()["bushing_20x26x30"]
    mesh = recipe.make(recipe.dimensions).mesh
    plugged = Solid(mesh=mesh, hulls=(mesh.convex_hull.vertices[::8],))
    with pytest.raises(BadPart, match=r"95 % of the surface is within .* mm .*volume ratio 2\.\d\d"):
        written(plugged)
    part = written(plugged, coarse=True)
    assert part.grade == "coarse" and part.hull_volume_ratio > 2
    assert read_part(part.folder).grade == "coarse"


@pytest.mark.parametrize(
    "solid, reason",
    [
        (box((120, 40, 1)), "hull 0 is 126 times longer than thick"),
        (
            Solid(mesh=(ball := trimesh.creation.icosphere(2, 20.0)), hulls=(np.array(ball.vertices),)),
            "hull 0 has 162 vertices and 320 faces, the limits are 32 and 64",
        ),
    ],
)
def test_hulls_that_physx_would_change_are_refused(solid: Solid, reason: str):
    with pytest.raises(BadPart, match=f"^{reason}"):
        written(solid)
