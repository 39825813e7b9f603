import pytest

from mskgrasp.simulation.hull_count import USUAL_HULLS, hull_excess
from tasks.scene.physics import MOST_HULLS


def test_usual_parts_have_as_many_pieces_as_the_engine_makes_room_for():
    assert USUAL_HULLS == MOST_HULLS


@pytest.mark.parametrize(("n_hulls", "times"), [(1, 1), (USUAL_HULLS, 1), (3 * USUAL_HULLS, 3)])
def test_parts_of_many_pieces_have_so_many_times_the_usual_number(n_hulls, times):
    assert hull_excess(n_hulls) == times
