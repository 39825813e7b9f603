import pytest

from mskgrasp.perception.markers import Markers
from tests.perception.markers.drawn import BEFORE, draw, find


@pytest.fixture(scope="module")
def before() -> Markers:
    return find(draw(BEFORE))
