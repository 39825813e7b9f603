import numpy as np
import pytest

from mskgrasp.core.errors import NoPartFound
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.perception.footprint import (
    Footprint,
    footprint_of,
    narrowest_width,
    pixel_pitch,
    seen_footprint,
)
from tests import synthetic
from tests.synthetic import REGION, TABLE_Z, Box


@pytest.mark.parametrize("theta", [-1.5, -0.4, 0.0, 0.7, 1.5])
def test_the_footprint_of_a_rectangles_corners_is_the_rectangle(theta):
    local = np.array([[0.04, 0.01], [0.04, -0.01], [-0.04, -0.01], [-0.04, 0.01]])
    cos, sin = np.cos(theta), np.sin(theta)
    found = footprint_of(local @ np.array([[cos, sin], [-sin, cos]]) + [0.45, 0.02])
    assert found.sides == pytest.approx([0.08, 0.02], abs=1e-6)
    assert float(wrap_half_turn(np.asarray(found.theta - theta))) == pytest.approx(0.0, abs=1e-4)


def test_the_extent_is_that_of_the_turned_rectangle():
    footprint = Footprint(sides=np.array([0.08, 0.02]), theta=0.0)
    assert footprint.extent(0.0) == pytest.approx([0.08, 0.02])
    assert footprint.extent(np.pi / 2) == pytest.approx([0.02, 0.08])
    assert footprint.extent(-np.pi / 4) == pytest.approx([0.1 / np.sqrt(2)] * 2)


@pytest.mark.parametrize("yaw", [0.0, 0.5, -1.2])
def test_a_seen_box_has_its_sides_and_direction_within_a_pixel(yaw):
    frame = synthetic.frame([Box(x=0.45, y=0.02, yaw=yaw, size=(0.08, 0.03, 0.004))])
    found = seen_footprint(frame, table_z=TABLE_Z, region=REGION, min_height=0.002)
    pitch = pixel_pitch(frame)
    assert pitch == pytest.approx(0.8 / 365.5, rel=0.01)
    assert np.abs(found.sides - [0.08, 0.03]).max() < 1.5 * pitch
    assert abs(float(wrap_half_turn(np.asarray(found.theta - yaw)))) < 0.04


def test_the_low_plate_of_a_bracket_is_part_of_its_footprint():
    """A plate of 4 mm with a wall of 40 mm."""
    plate = Box(x=0.47, y=0.0, yaw=0.5, size=(0.08, 0.03, 0.004))
    wall = Box(x=0.47 + 0.038 * np.cos(0.5), y=0.038 * np.sin(0.5), yaw=0.5, size=(0.004, 0.03, 0.04))
    found = seen_footprint(synthetic.frame([plate, wall]), table_z=TABLE_Z, region=REGION, min_height=0.002)
    assert abs(found.theta - 0.5) < np.radians(3.0)
    np.testing.assert_allclose(found.sides, [0.08, 0.03], atol=0.003)


def test_an_empty_table_has_no_footprint():
    with pytest.raises(NoPartFound):
        seen_footprint(synthetic.frame([]), table_z=TABLE_Z, region=REGION, min_height=0.002)


@pytest.mark.parametrize("turn", np.linspace(0, np.pi, 7))
def test_the_narrowest_width_of_a_shape_does_not_depend_on_its_turn(turn: float):
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def width(points: list[tuple[float, float]]) -> float:
        return narrowest_width(np.array(points) @ rotation.T + [0.5, -0.1])

    assert width([(0, 0), (0.1, 0), (0.1, 0.03), (0, 0.03), (0.05, 0.01)]) == pytest.approx(0.03, abs=1e-6)
    # A right triangle of 3, 4 and 5 is as narrow as its height over the longest side.
    assert width([(0, 0), (0.03, 0), (0, 0.04)]) == pytest.approx(0.024, abs=1e-6)
    circle = [(0.04 * np.cos(a), 0.04 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 200)]
    assert width(circle) == pytest.approx(0.08, abs=1e-4)
    assert width([(0, 0), (0.1, 0.0)]) == pytest.approx(0.0, abs=1e-6)
    assert width([(0, 0)]) == 0.0


def test_a_part_that_is_known_to_be_flat_has_a_footprint():
    frame = synthetic.frame([Box(x=0.45, y=0.02, yaw=0.3, size=(0.06, 0.03, 0.0016))])
    with pytest.raises(NoPartFound, match="nothing rises"):
        seen_footprint(frame, table_z=TABLE_Z, region=REGION, min_height=0.002)
    found = seen_footprint(frame, table_z=TABLE_Z, region=REGION, min_height=0.002, part_height=0.0016)
    assert np.abs(found.sides - [0.06, 0.03]).max() < 1.5 * pixel_pitch(frame)
