"""Steps between coordinates of seven digits, by the size of what they describe."""

import numpy as np
import pytest

from mskgrasp.parts.importing.formats import Unreadable
from mskgrasp.parts.importing.formats.float32 import check_resolution
from mskgrasp.parts.solids.surface import Surface
from tests.parts.importing.surfaces import box


def test_the_length_is_that_of_all_objects_and_the_distance_may_be_another():
    near, far = box(10, 10, 10), box(10, 10, 10, at=(2000, 0, 0))
    check_resolution([near])
    check_resolution([near, far])  # together 2 m long
    with pytest.raises(Unreadable, match="lies 200 times its length from its origin, where numbers of 7"):
        check_resolution([far])
    check_resolution([far], coarsest=1e-3)
    check_resolution([far], 5.0)
    with pytest.raises(Unreadable, match="move it to the origin"):
        check_resolution([near], 2000.0)


def test_what_is_damaged_is_left_to_other_checks():
    check_resolution([])
    body = box(10, 10, 10, at=(1e6, 0, 0))
    check_resolution([Surface(vertices=body.vertices, faces=body.faces[:0])])
    check_resolution([Surface(vertices=body.vertices * np.nan, faces=body.faces)])
    check_resolution([Surface(vertices=body.vertices, faces=body.faces + 100)])
