"""The noise of the simulated camera against numbers that it did not compute itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hal.sensor_noise import SensorNoise, add_noise, axial_sigma, incidence_angles
from mskgrasp.core.config import Config, check_config
from mskgrasp.core.errors import BadConfig

K = np.array([[365.5, 0.0, 79.5], [0.0, 365.5, 79.5], [0.0, 0.0, 1.0]])
KINECT2 = SensorNoise(model="kinect2", offset=0.0)


def plane(tilt: float, distance: float = 1.0, size: int = 160) -> np.ndarray:
    """Depth of a plane turned by ``tilt`` about the image's vertical, ``distance`` m away on the axis."""
    columns = (np.arange(size) - 79.5) / 365.5
    depth = distance / (1 - columns * np.tan(tilt))
    return np.tile(np.where((depth > 0) & (depth < 4), depth, np.nan), (size, 1))


@pytest.mark.parametrize(
    ("depth", "degrees", "millimetres"),
    # Fankhauser's formula worked out by hand.
    [(1.0, 0, 1.300), (1.2, 0, 1.332), (1.5, 0, 1.425), (2.0, 0, 1.700), (1.0, 60, 1.700), (1.0, 45, 1.400)],
)
def test_axial_noise_is_fankhausers(depth: float, degrees: float, millimetres: float):
    sigma = axial_sigma(np.array(depth), np.radians(degrees))
    assert 1e3 * float(sigma) == pytest.approx(millimetres, abs=5e-4)


@pytest.mark.parametrize(("degrees", "millimetres"), [(0, 1.300), (60, 1.700)])
def test_the_noise_of_a_plane_has_the_formulas_spread(degrees: float, millimetres: float):
    clean = plane(np.radians(degrees))
    noisy = add_noise(clean, K, KINECT2, np.random.default_rng(0))
    # The middle columns: there the distance is 1 m and the ray meets the plane at the plane's tilt.
    error = (noisy - clean)[:, 78:82].ravel()
    assert 1e3 * np.nanstd(error) == pytest.approx(millimetres, rel=0.08)
    assert abs(np.nanmean(error)) < 2e-4


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_the_angle_of_incidence_on_the_axis_is_the_tilt(degrees: float):
    angle = incidence_angles(plane(np.radians(degrees)), K)[80, 79:81].mean()
    assert np.degrees(angle) == pytest.approx(degrees, abs=0.5)


def test_a_table_is_met_at_the_angle_of_its_ray():
    angle = incidence_angles(np.full((160, 160), 0.8), K)
    assert angle[80, 0] == pytest.approx(np.arctan(np.hypot(79.5, 0.5) / 365.5), abs=1e-6)


def test_an_edge_does_not_make_the_surfaces_beside_it_steep():
    depth = np.full((160, 160), 0.8)
    depth[60:100, 60:100] = 0.7
    assert np.degrees(incidence_angles(depth, K).max()) < 18


def test_pixels_fly_between_both_sides_of_an_edge_and_nowhere_else():
    depth = np.full((160, 160), 0.8)
    depth[60:100, 60:100] = 0.7
    noisy = add_noise(
        depth, K, SensorNoise(model="kinect2", offset=0.0, flying=0.5), np.random.default_rng(1)
    )
    between = (noisy > 0.71) & (noisy < 0.79)
    edge = np.zeros_like(between)
    edge[59:101, 59:101] = True
    edge[61:99, 61:99] = False
    edge[[59, 59, 100, 100], [59, 100, 59, 100]] = False  # corners touch no side
    assert not (between & ~edge).any()
    # Half of the edge's pixels fly; of those, eight of ten end in the middle eight of ten centimetres.
    assert between[edge].mean() == pytest.approx(0.4, abs=0.08)
    none = add_noise(depth, K, SensorNoise(model="kinect2", flying=0.0), np.random.default_rng(1))
    assert not ((none > 0.71) & (none < 0.79)).any()


@pytest.mark.parametrize(("degrees", "share"), [(60, 0.0), (80, 0.5), (88, 1.0)])
def test_a_grazing_surface_is_not_seen(degrees: float, share: float):
    """Holes begin at 75 degrees and are everything from 85 on."""
    noisy = add_noise(plane(np.radians(degrees), size=160), K, KINECT2, np.random.default_rng(2))
    assert np.isnan(noisy[:, 79:81]).mean() == pytest.approx(share, abs=0.1)


def test_the_offset_is_added_everywhere():
    clean = plane(0.3)
    one, other = (
        add_noise(clean, K, SensorNoise(model="kinect2", offset=offset), np.random.default_rng(3))
        for offset in (0.0, 0.024)
    )
    assert np.allclose(other - one, 0.024, atol=1e-6)


def test_independent_noise_is_the_papers_three_millimetres():
    clean = plane(0.5)
    error = add_noise(clean, K, SensorNoise(model="iid"), np.random.default_rng(4)) - clean
    assert np.std(error) == pytest.approx(3e-3, rel=0.03)
    neighbours = np.corrcoef(error[:, :-1].ravel(), error[:, 1:].ravel())[0, 1]
    assert abs(neighbours) < 0.03


@pytest.mark.parametrize("model", ["off", "iid", "kinect2"])
def test_noise_follows_from_the_generator_and_changes_no_argument(model: Any):
    clean = plane(0.4)
    clean[:5] = np.nan
    before = clean.copy()
    noise = SensorNoise(model=model)
    one, same, other = (add_noise(clean, K, noise, np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert np.array_equal(one, same, equal_nan=True) and one.dtype == np.float32
    assert np.array_equal(one, other, equal_nan=True) == (model == "off")
    assert np.array_equal(clean, before, equal_nan=True) and np.isnan(one[:5]).all()


class Camera(Config):
    noise: SensorNoise = SensorNoise()


@pytest.mark.parametrize(
    ("values", "model"),
    [
        ({}, "off"),
        ({"noise": False}, "off"),
        ({"noise": "kinect2"}, "kinect2"),
        ({"noise": {"model": "iid"}}, "iid"),
        ({"noise": {"model": False}}, "off"),
    ],
)
def test_a_cells_file_names_the_model_alone_or_with_its_settings(values: dict[str, Any], model: str):
    """YAML reads a bare ``off`` as false."""
    assert check_config(Camera, values, "cell.yaml").noise.model == model


@pytest.mark.parametrize(
    ("noise", "message"),
    [
        ("kinect", "'kinect2'"),
        (True, "noise"),
        ({"model": "kinect2", "sigma": 1}, "unknown key 'noise.sigma'"),
        ({"model": "kinect2", "hole_from": 88}, "hole_from 88 must be less than hole_to 85"),
        ({"model": "kinect2", "offset": 24}, "less than or equal to 0.05"),
    ],
)
def test_wrong_noise_is_one_line(noise: Any, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(Camera, {"noise": noise}, "cell.yaml")
    assert message in str(caught.value) and "\n" not in str(caught.value)
