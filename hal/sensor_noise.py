"""Noise models of depth sensors. Pure functions with an explicit generator."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from mskgrasp.core.config import Config

NoiseModel = Annotated[
    Literal["off", "iid", "kinect2"],
    BeforeValidator(lambda value: "off" if value is False else value),  # YAML reads a bare `off` as false
]


class SensorNoise(Config):
    """Noise of the simulated camera; a cell file may name the model alone, ``noise: kinect2``."""

    model: NoiseModel = "off"
    """off: perfect. iid: independent pixels, as in the paper. kinect2: a model of the Kinect v2."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the noise of all frames, with the seed of the part's placement."""
    iid_sigma: float = Field(default=0.003, ge=0, le=0.05)
    """Standard deviation of the model iid, m (the paper's: 3 mm)."""
    offset: float = Field(default=0.002, ge=-0.05, le=0.05)
    """Offset of a kinect2's depth, m: about 0.024 uncorrected, a few mm once corrected."""
    edge_jump: float = Field(default=0.01, gt=0, le=0.5)
    """Neighbouring pixels of a kinect2 that differ by more than this, and by more than their slope, m."""
    flying: float = Field(default=0.5, ge=0, le=1)
    """Share of the pixels at such an edge that float between its two sides."""
    hole_from: float = Field(default=75.0, ge=0, lt=90)
    """From this angle between ray and normal on a kinect2 begins to see nothing, degrees."""
    hole_to: float = Field(default=85.0, gt=0, le=90)
    """From this angle on it sees nothing at all, degrees."""

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, values: Any) -> Any:
        return {"model": values} if isinstance(values, str | bool) else values

    @model_validator(mode="after")
    def _check(self) -> SensorNoise:
        if self.hole_from >= self.hole_to:
            raise ValueError(
                f"hole_from {self.hole_from:g} must be less than hole_to {self.hole_to:g} degrees"
            )
        return self

    @property
    def least_height(self) -> float:
        """Height over a table that may be noise, metres, once heights are smoothed (`part_detection`).

        A greater height loses flat parts; a smaller one counts noise around a part as the part.
        """
        return 0.002 if self.model == "off" else 0.003


def add_noise(
    depth: np.ndarray, intrinsics: np.ndarray, noise: SensorNoise, rng: np.random.Generator
) -> np.ndarray:
    """The image as the sensor would deliver it.

    Args:
        depth: (h, w) metres along the optical axis, NaN where there is nothing.
        intrinsics: (3, 3) pinhole matrix, pixels; the centre of a pixel has integer coordinates.
        noise: Noise model of the sensor.
        rng: Random generator.

    Returns:
        (h, w) float32 metres, NaN where the sensor sees nothing.
    """
    match noise.model:
        case "off":
            return depth.astype(np.float32)
        case "iid":
            return (depth + noise.iid_sigma * rng.standard_normal(depth.shape)).astype(np.float32)
        case "kinect2":
            return _kinect2(depth.astype(np.float64), intrinsics, noise, rng)


def axial_sigma(depth: np.ndarray, incidence: np.ndarray) -> np.ndarray:
    """Standard deviation of a Kinect v2's depth, metres.

    Fankhauser et al., Kinect v2 for Mobile Robot Navigation, ICAR 2015 (doi 10.1109/ICAR.2015.7251485):
    in millimetres 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^1.5 t^2 / (pi/2 - t)^2.

    Args:
        depth: Metres.
        incidence: Angle t between the ray and the surface's normal, radians, less than pi/2.
    """
    grazing = incidence**2 / (np.pi / 2 - incidence) ** 2
    return 1e-3 * (1.5 - 0.5 * depth + 0.3 * depth**2 + 0.1 * depth**1.5 * grazing)


def incidence_angles(depth: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """Angles (h, w) between rays and surface normals, radians in [0, pi/2]; NaN where there is no depth.

    The slope in each direction is that towards the nearer of both neighbours in depth, so that the edge of
    a part does not make its top appear steep.
    """
    rays = _rays(depth.shape, intrinsics)
    points = rays * depth[..., None]
    normal = np.cross(_tangent(points, depth, axis=1), _tangent(points, depth, axis=0))
    length = np.linalg.norm(normal, axis=-1) * np.linalg.norm(rays, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs((normal * rays).sum(axis=-1)) / length
    return np.where(np.isfinite(depth), np.arccos(np.clip(np.nan_to_num(cosine, nan=1.0), 0, 1)), np.nan)


def _kinect2(
    depth: np.ndarray, intrinsics: np.ndarray, noise: SensorNoise, rng: np.random.Generator
) -> np.ndarray:
    # All numbers are drawn first and for every pixel, so that a change of one setting changes nothing else.
    axial, hole, chosen, share = (
        rng.standard_normal(depth.shape), *(rng.random(depth.shape) for _ in range(3))
    )  # fmt: skip
    incidence = incidence_angles(depth, intrinsics)
    nearest, farthest = _extremes(depth)
    # A steep wall is no edge: across one pixel it falls by its slope.
    pixel = depth / min(intrinsics[0, 0], intrinsics[1, 1])
    edge = farthest - nearest > noise.edge_jump + 3 * pixel * np.tan(np.minimum(incidence, 1.5))
    flying = edge & (chosen < noise.flying)
    seen = np.where(flying, nearest + share * (farthest - nearest), depth)
    sigma = axial_sigma(depth, np.minimum(incidence, np.radians(noise.hole_to)))
    lower, upper = np.radians(noise.hole_from), np.radians(noise.hole_to)
    blind = hole < (incidence - lower) / (upper - lower)
    result = seen + sigma * axial + noise.offset
    return np.where(blind, np.nan, result).astype(np.float32)


def _rays(shape: tuple[int, ...], intrinsics: np.ndarray) -> np.ndarray:
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]]
    x = (columns - intrinsics[0, 2]) / intrinsics[0, 0]
    y = (rows - intrinsics[1, 2]) / intrinsics[1, 1]
    return np.stack([x, y, np.ones(shape)], axis=-1)


def _tangent(points: np.ndarray, depth: np.ndarray, axis: int) -> np.ndarray:
    """(h, w, 3) step to the neighbour along an axis that is nearer in depth; zero where there is none."""
    step, jump = np.diff(points, axis=axis), np.abs(np.diff(depth, axis=axis))
    zero, far = np.zeros_like(points.take([0], axis)), np.full_like(depth.take([0], axis), np.inf)
    jump = np.where(np.isnan(jump), np.inf, jump)
    forward_step, backward_step = np.concatenate([step, zero], axis), np.concatenate([zero, step], axis)
    forward_jump, backward_jump = np.concatenate([jump, far], axis), np.concatenate([far, jump], axis)
    tangent = np.where((forward_jump <= backward_jump)[..., None], forward_step, backward_step)
    return np.nan_to_num(tangent)


def _extremes(depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest depth of each pixel and its four neighbours, (h, w) each; NaN counts for nothing."""
    padded = np.pad(depth, 1, constant_values=np.nan)
    around = [padded[1:-1, 1:-1], padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]]
    nearest, farthest = depth, depth
    for other in around[1:]:
        nearest, farthest = np.fmin(nearest, other), np.fmax(farthest, other)
    return nearest, farthest
