"""Surfaces that boolean operations would change are refused."""

import numpy as np
import pytest

from tests.parts.importing.surfaces import extruded, refusal


def test_faces_folded_over_their_neighbours_are_refused_for_booleans_would_not_keep_the_volume():
    # The ends are fans about a point from which the notch hides a part of the rim.
    outline = np.array([(0, 0), (40, 0), (40, 40), (22, 40), (20, 5), (18, 40), (0, 40)], dtype=float)
    folded = extruded(outline - (7, 13), 10.0)
    assert folded.volume == pytest.approx(15_300)
    assert "folded" in refusal(folded)
