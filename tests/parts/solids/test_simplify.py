"""Decimation within the reported distance."""

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.solids.surface import Surface
from tests.parts.importing.surfaces import TORUS_VOLUME, one, torus


def test_a_fine_mesh_is_decimated_within_the_reported_distance():
    fine = torus(600, 200)
    repaired = one(fine)
    thin = repaired.bodies[0]
    assert len(thin.faces) < 50_000 and thin.is_watertight
    assert repaired.notes[0].startswith("decimated from 240,000 to ")
    said = float(repaired.notes[0].split("at most ")[1].split()[0])
    # The torus knows how far a point is from its surface; its own facets are 0.01 mm inside it.
    points = np.concatenate([thin.vertices, thin.triangles_center])
    true = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 30, points[:, 2]) - 10
    assert 0 < said <= 0.05 and np.abs(true).max() < said + 0.02
    assert thin.volume == pytest.approx(TORUS_VOLUME, rel=2e-3)


@pytest.mark.slow
def test_a_mesh_too_rough_to_be_decimated_is_refused():
    rough = torus(700, 160)
    rng = np.random.default_rng(2)
    noise = rng.uniform(-0.3, 0.3, rough.vertices.shape)
    with pytest.raises(BadPart, match="the most is 200,000"):
        one(Surface(vertices=rough.vertices + noise * 0.2, faces=rough.faces))
