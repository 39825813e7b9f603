"""Requests of clients: the fields of each, and their checks."""

from __future__ import annotations

import base64
import binascii
import json
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, ValidationError
from pydantic_core import from_json

from hal.camera import RgbdFrame
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.planning.place_pose import Target
from mskgrasp.serve.bounded_arrays import MAX_SIDE, check_shape, read_npz, read_png16
from mskgrasp.serve.rejection import Rejected

JSON = "application/json"
NPZ = "application/x-npz"
Kind = Literal["plan", "score"]

MAX_GRASPS = 4096
"""Most grasps of a request to /score."""
_MOST_VALUES = 8 * MAX_GRASPS
"""Most commas or brackets in JSON: some more than the largest request has."""
MAX_ALTERNATIVES = 100
"""Most alternatives that a request may ask for."""
REACH = 3.0
"""Greatest distance of a camera or a grasp from the base along an axis, metres."""
UNIT = 1e-3
"""Greatest difference of a quaternion's length from 1."""
MAX_PLACE_BYTES = 10_000
"""Longest request to /place."""

Length = Annotated[float, Field(ge=-REACH, le=REACH)]
# In single precision, in which arrays of grasps often are, half of pi is more than in double precision.
HalfTurn = Annotated[float, Field(ge=-np.pi / 2 - 1e-6, le=np.pi / 2 + 1e-6)]
Turn = Annotated[float, Field(ge=-np.pi, le=np.pi)]
Number = Annotated[float, Field(ge=-1e5, le=1e5)]
GraspVector = tuple[Length, Length, Length, HalfTurn]
Row = tuple[Number, Number, Number]
DEPTH_SCALE = 1e-4


class _Request(Config):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class FrameRequest(_Request):
    """Depth image of an overhead camera; in npz the array ``depth`` takes the place of ``depth_png``."""

    depth_png: str | None = None
    """Grey PNG of 16 bits as base64, 0 where invalid."""
    depth_scale: float | None = Field(default=None, gt=0, le=0.01)
    """Metres of one count of an image of integers; null: 0.0001."""
    intrinsics: tuple[Row, Row, Row]
    """Pinhole matrix, pixels."""
    T_base_camera: tuple[Length, Length, Length, Number, Number, Number, Number]
    """Pose of the optical frame in the base: x y z qw qx qy qz, metres."""


class PlanRequest(FrameRequest):
    """Request of a grasp of the part in an image."""

    seed: int = Field(default=0, ge=0, le=2**63 - 1)
    """Determines the candidates."""
    alternatives: int = Field(
        default=10,
        ge=0,
        le=MAX_ALTERNATIVES,
        description="Greatest number of grasps to list, never more than n_shortlist - 1 of the answer",
    )
    """Greatest number of other grasps to list."""


class ScoreRequest(FrameRequest):
    """Request of predictions for grasps of one's own."""

    grasps: list[GraspVector] = Field(min_length=1, max_length=MAX_GRASPS)
    """x y z theta of each, base frame, metres and radians."""


class TargetRequest(_Request):
    """Target of the part's centre."""

    x: Length
    """Base frame, metres."""
    y: Length
    """Base frame, metres."""
    theta: Turn
    """Rotation of the part about the vertical from its initial pose, radians."""


class PlaceRequest(_Request):
    """Request of the hand's pose at which the held part is at a target."""

    grasp: GraspVector
    """x y z theta, base frame, metres and radians."""
    displacement: tuple[Length, Length, Length, Turn]
    """Of the centre in the grasp frame, metres and radians; zeros place without correction."""
    centre_base: tuple[Length, Length, Length]
    """The part's centre before the grasp, base frame, metres."""
    target: TargetRequest
    """Where the centre is to be."""
    drop: float = Field(default=0.0, ge=0.0, le=0.2)
    """Height by which the lowest corner of the part hangs lower in the hand, metres."""

    def parts(self) -> tuple[Grasp, Target]:
        """The grasp and the target."""
        grasp = Grasp.from_vector(np.array(self.grasp))
        return grasp, Target(x=self.target.x, y=self.target.y, theta=self.target.theta)


REQUESTS: dict[Kind, type[FrameRequest]] = {"plan": PlanRequest, "score": ScoreRequest}
_MAX_ITEMS = {
    "depth": MAX_SIDE**2,
    "depth_scale": 1,
    "intrinsics": 9,
    "T_base_camera": 7,
    "seed": 1,
    "alternatives": 1,
    "grasps": 4 * MAX_GRASPS,
}
RequestT = TypeVar("RequestT", bound=_Request)
FrameT = TypeVar("FrameT", bound=FrameRequest)


def parse_json(kind: type[RequestT], body: bytes) -> RequestT:
    """Check a request in JSON.

    Raises:
        Rejected: It is not JSON, has too many values, or a field is missing, unknown or not legal.
    """
    # Counted first: parsed, a body of many small values takes a hundred times its size. None is in base64.
    if max(body.count(sign) for sign in b",[{") > _MOST_VALUES:
        raise Rejected(413, f"the request has more values than {MAX_GRASPS} grasps have; send fewer grasps")
    _refuse_unknown(kind, body)
    try:
        return kind.model_validate_json(body, strict=True)
    except ValidationError as error:
        raise Rejected(400, _explain(kind, error)) from error


def _refuse_unknown(kind: type[Config], body: bytes) -> None:
    """Refuse an unknown field here: pydantic makes an error of each, a gigabyte of a million of them."""
    try:
        fields = from_json(body, cache_strings=False)
    except ValueError:
        return  # pydantic says why
    unknown = (name for name in fields if name not in kind.model_fields) if isinstance(fields, dict) else ()
    for name in unknown:
        raise Rejected(400, f"{name[:80]}: extra inputs are not permitted; {_legal(kind)}")


def parse_frame(kind: type[FrameT], content_type: str, body: bytes) -> tuple[FrameT, RgbdFrame]:
    """Check a request that holds a frame, in either form.

    Args:
        kind: Its class.
        content_type: `JSON` or `NPZ`.
        body: The request.

    Returns:
        Its fields, and the frame; its colour is black.

    Raises:
        Rejected: Something is missing, unknown, damaged or not plausible.
    """
    if content_type == JSON:
        request = parse_json(kind, body)
        depth = _depth_of_png(request)
    else:
        arrays = read_npz(
            body, {name: n for name, n in _MAX_ITEMS.items() if name in (*kind.model_fields, "depth")}
        )
        depth = arrays.pop("depth", None)
        if depth is None:
            raise Rejected(400, "the npz file has no array depth; add (h, w) metres, NaN where invalid")
        try:
            request = kind.model_validate({name: array.tolist() for name, array in arrays.items()})
        except ValidationError as error:
            raise Rejected(400, _explain(kind, error)) from error
    return request, _frame(request, depth)


def _depth_of_png(request: FrameRequest) -> np.ndarray:
    if request.depth_png is None:
        raise Rejected(400, "depth_png is missing; send the depth as PNG of 16 bits in base64, or send npz")
    try:
        return read_png16(base64.b64decode(request.depth_png, validate=True))
    except (binascii.Error, ValueError) as error:
        raise Rejected(400, "depth_png is not base64; encode the PNG image as base64") from error


def _frame(request: FrameRequest, depth: np.ndarray) -> RgbdFrame:
    """Make the frame; what is not plausible is refused, since a plan from it would be wrong unnoticed."""
    check_shape(depth.shape)
    metres = _metres(depth, request.depth_scale)
    intrinsics = np.array(request.intrinsics)
    _check_intrinsics(intrinsics, depth.shape)
    pose = np.array(request.T_base_camera)
    length = float(np.linalg.norm(pose[3:]))
    if abs(length - 1) > UNIT:
        raise Rejected(
            400, f"T_base_camera: the quaternion qw qx qy qz has length {length:.4g}; send one of length 1"
        )
    return RgbdFrame(
        colour=np.broadcast_to(np.zeros(3, np.uint8), (*depth.shape, 3)),
        depth=metres,
        intrinsics=intrinsics,
        T_base_camera=Pose(position=pose[:3], quat_wxyz=pose[3:] / length),
        timestamp_s=0.0,
        serial="request",
    )


def _metres(depth: np.ndarray, scale: float | None) -> np.ndarray:
    if depth.dtype.kind == "f":
        if scale is not None:
            raise Rejected(400, "depth_scale is for images of integers; send depth in metres without it")
        if np.isinf(depth).any() or (depth < 0).any():
            raise Rejected(400, "depth has infinite or negative pixels; write NaN where it is invalid")
    elif depth.dtype.kind == "i" and (depth < 0).any():
        raise Rejected(400, "depth has negative pixels; write 0 where it is invalid")
    factor = (DEPTH_SCALE if scale is None else scale) if depth.dtype.kind != "f" else 1.0
    metres = depth.astype(np.float64) * factor
    if (metres > 20).any():
        raise Rejected(400, "depth has pixels over 20 m; send metres, or the depth_scale of its counts")
    return np.where(metres > 0, metres, np.nan).astype(np.float32)


def _check_intrinsics(matrix: np.ndarray, shape: tuple[int, ...]) -> None:
    height, width = shape
    (fx, skew, cx), (below, fy, cy), last = matrix
    longest = max(shape)
    focal = (
        0.2 * longest <= fx <= 20 * longest and 0.2 * longest <= fy <= 20 * longest and 0.5 <= fx / fy <= 2
    )
    centred = -0.5 * width <= cx <= 1.5 * width and -0.5 * height <= cy <= 1.5 * height
    if not (focal and centred and below == 0 and abs(skew) <= 0.01 * fx and (last == [0, 0, 1]).all()):
        raise Rejected(
            400,
            f"intrinsics are not those of an image of {height} x {width} pixels: send [[fx, 0, cx], "
            "[0, fy, cy], [0, 0, 1]] in pixels",
        )


def _explain(kind: type[Config], error: ValidationError) -> str:
    """The first problem in one line, without the value, which may be long."""
    first = error.errors(include_url=False, include_input=False)[0]
    name = ".".join(map(str, first["loc"]))[:80]
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    problem = f"{name}: {first['msg'].lower()}" if name else first["msg"].lower()
    return f"{problem}{more}; {_legal(kind)}"


def _legal(kind: type[Config]) -> str:
    return f"legal fields: {', '.join(kind.model_fields)}"


def body_schema(kind: type[_Request]) -> dict[str, Any]:
    """Description of a request's body for OpenAPI."""
    content: dict[str, Any] = {JSON: {"schema": _inlined(kind)}}
    if issubclass(kind, FrameRequest):
        content[NPZ] = {"schema": {"type": "string", "format": "binary"}}
    return {"requestBody": {"required": True, "content": content}}


def _inlined(kind: type[_Request]) -> Any:
    """Schema without references, which OpenAPI would look up elsewhere."""
    schema = kind.model_json_schema()
    text = json.dumps({name: value for name, value in schema.items() if name != "$defs"})
    for name, value in schema.get("$defs", {}).items():
        text = text.replace(json.dumps({"$ref": f"#/$defs/{name}"}), json.dumps(value))
    return json.loads(text)
