"""Space that the arm keeps out of: spheres, capsules and boxes in the base frame. Pure functions."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mskgrasp.core.geometry import Pose

CAMERA_SIZE = (0.249, 0.066, 0.067)
"""Width, height and depth of a camera's body, metres: a Kinect v2 (249 mm x 66 mm x 67 mm by its maker)."""
CAMERA_OFF_CENTRE = 0.03
"""Greatest distance of the depth camera from the middle of the body's width, metres."""
_PARALLEL = 1e-12


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """All points within a radius of a segment; a sphere, if both ends are the same.

    Attributes:
        name: For messages, such as "post".
        ends: (2, 3) metres.
        radius: Metres.
    """

    name: str
    ends: np.ndarray
    radius: float

    def distance(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Distances (...) of segments between (..., 3) and (..., 3), metres; negative inside."""
        return segment_distance(first, second, self.ends[0], self.ends[1]) - self.radius


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box along the base's axes.

    Attributes:
        name: For messages, such as "shelf".
        lower: (3,) corner, metres.
        upper: (3,) the other corner, metres.
    """

    name: str
    lower: np.ndarray
    upper: np.ndarray

    def distance(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Distances (...) of segments between (..., 3) and (..., 3), metres; 0 inside."""
        return box_distance(first, second, self.lower, self.upper)


KeepOut = Capsule | Box


def segment_distance(first: np.ndarray, second: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances (...) of segments between (..., 3) and (..., 3) from that between a (3,) and b (3,), metres.

    Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
    """
    along, other, between = second - first, b - a, first - a
    aa, bb = (along * along).sum(-1), float(other @ other)
    ab, ac, bc = along @ other, (along * between).sum(-1), between @ other
    determinant = aa * bb - ab * ab
    apart = determinant > _PARALLEL
    s = np.where(apart, np.clip((ab * bc - ac * bb) / np.where(apart, determinant, 1.0), 0, 1), 0.0)
    t = (ab * s + bc) / bb if bb > _PARALLEL else np.zeros_like(s)
    clipped = np.clip(t, 0, 1)
    # Where the other end is nearest, the nearest point of the first segment is another.
    moves = (clipped != t) | ~apart
    s = np.where(moves, np.clip((ab * clipped - ac) / np.where(aa > _PARALLEL, aa, 1.0), 0, 1), s)
    gap = between + s[..., None] * along - clipped[..., None] * other
    return np.sqrt((gap * gap).sum(-1))


def box_distance(first: np.ndarray, second: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Distances (...) of segments between (..., 3) and (..., 3) from a box (3,), (3,), metres; 0 inside.

    Along a segment the squared distance is made of pieces, each quadratic, that meet where the segment passes
    the plane of a face; the least of each piece is known.
    """
    along = second - first
    with np.errstate(divide="ignore", invalid="ignore"):
        passes = np.concatenate([(lower - first) / along, (upper - first) / along], axis=-1)
    passes = np.clip(np.nan_to_num(passes, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    zero = np.zeros((*passes.shape[:-1], 1))
    cuts = np.sort(np.concatenate([zero, passes, zero + 1], axis=-1), axis=-1)
    begin, end = cuts[..., :-1, None], cuts[..., 1:, None]
    start, way = first[..., None, :], along[..., None, :]
    middle = start + (begin + end) / 2 * way
    # In a piece each axis is beyond one face, beyond the other, or between them.
    face = np.where(middle < lower, lower, np.where(middle > upper, upper, np.nan))
    off, rate = np.where(np.isnan(face), 0.0, start - face), np.where(np.isnan(face), 0.0, way)
    steep = (rate * rate).sum(-1)
    least = -(off * rate).sum(-1) / np.where(steep > _PARALLEL, steep, 1.0)
    least = np.clip(least, begin[..., 0], end[..., 0])[..., None]
    gap = off + least * rate
    return np.sqrt((gap * gap).sum(-1).min(-1))


def camera_keep_out(T_base_camera: Pose) -> Capsule:
    """Space of a camera's body behind its lens, from its pose.

    Args:
        T_base_camera: Pose of the optical frame, x along the body's width, z out of the lens.
    """
    width, height, depth = CAMERA_SIZE
    radius = float(np.hypot(height, depth)) / 2
    half = width / 2 + CAMERA_OFF_CENTRE - radius / 2
    ends = T_base_camera.apply(np.array([[-half, 0.0, -depth / 2], [half, 0.0, -depth / 2]]))
    return Capsule(name="camera", ends=ends, radius=radius)


def to_plain(one: KeepOut) -> dict[str, Any]:
    """Plain values of a shape, for recordings."""
    shape = "capsule" if isinstance(one, Capsule) else "box"
    values = {key: np.asarray(value).tolist() for key, value in asdict(one).items() if key != "name"}
    return dict(shape=shape, name=one.name) | values


def from_plain(values: dict[str, Any]) -> KeepOut:
    """The shape that `to_plain` converted.

    Raises:
        KeyError, ValueError, TypeError: The values are no shape.
    """
    name = str(values["name"])
    match values["shape"]:
        case "capsule":
            ends = np.array(values["ends"], dtype=np.float64).reshape(2, 3)
            return Capsule(name=name, ends=ends, radius=float(values["radius"]))
        case "box":
            lower, upper = (np.array(values[key], dtype=np.float64).reshape(3) for key in ("lower", "upper"))
            return Box(name=name, lower=lower, upper=upper)
        case other:
            raise ValueError(f"shape {other!r}")
