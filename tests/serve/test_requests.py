"""Requests become frames and fields."""

from __future__ import annotations

import json
import tracemalloc

import numpy as np
import pytest

from mskgrasp.serve.rejection import Rejected
from mskgrasp.serve.requests import (
    JSON,
    MAX_GRASPS,
    NPZ,
    PlaceRequest,
    PlanRequest,
    ScoreRequest,
    body_schema,
    parse_frame,
    parse_json,
)
from tests.serve.bodies import FRAME, npz, png16, text, values


def test_both_forms_give_the_same_frame():
    asked, frame = parse_frame(PlanRequest, NPZ, npz(seed=3, alternatives=2))
    assert (asked.seed, asked.alternatives) == (3, 2)
    np.testing.assert_array_equal(frame.depth, FRAME.depth)
    np.testing.assert_allclose(frame.T_base_camera.as_vector(), FRAME.T_base_camera.as_vector())
    other, again = parse_frame(PlanRequest, JSON, text(seed=3, alternatives=2))
    assert (other.seed, other.alternatives) == (3, 2)
    np.testing.assert_allclose(again.depth, FRAME.depth, atol=0.51e-4)
    np.testing.assert_array_equal(again.intrinsics, frame.intrinsics)


def test_invalid_pixels_are_nan_in_both_forms():
    depth = FRAME.depth.copy()
    depth[3, 4] = np.nan
    _, frame = parse_frame(PlanRequest, NPZ, npz(depth=depth))
    assert np.isnan(frame.depth[3, 4]) and np.isnan(frame.depth).sum() == 1
    counts = np.round(FRAME.depth / 1e-3).astype(np.uint16)
    counts[3, 4] = 0
    _, frame = parse_frame(PlanRequest, NPZ, npz(depth=counts, depth_scale=1e-3))
    assert np.isnan(frame.depth[3, 4]) and np.isnan(frame.depth).sum() == 1
    np.testing.assert_allclose(frame.depth[0], FRAME.depth[0], atol=0.51e-3)


def test_a_quaternion_of_nearly_unit_length_is_normalised():
    pose = FRAME.T_base_camera.as_vector()
    pose[3:] *= 1.0005
    _, frame = parse_frame(PlanRequest, NPZ, npz(T_base_camera=pose))
    assert np.linalg.norm(frame.T_base_camera.quat_wxyz) == pytest.approx(1, abs=1e-12)


def test_a_million_digits_and_deep_nesting_are_refused():
    bodies = {b"[" * 1_000_000: 413, b"[" * 10_000: 400, b"9" * 1_000_000: 400, text(seed=10**400): 400}
    for body, status in bodies.items():
        with pytest.raises(Rejected) as refused:
            parse_frame(PlanRequest, JSON, body)
        assert refused.value.status == status and len(str(refused.value)) < 500


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_grasp_may_be_turned_by_the_whole_half_turn_in_any_precision(dtype: type):
    grasps = np.array([[0.5, 0.0, 0.02, sign * np.pi / 2] for sign in (-1, 1)], dtype)
    asked, _ = parse_frame(ScoreRequest, NPZ, npz(grasps=grasps))
    np.testing.assert_allclose(asked.grasps, grasps)
    with pytest.raises(Rejected, match="grasps.0.3"):
        parse_frame(ScoreRequest, NPZ, npz(grasps=grasps * 1.001))


def test_unknown_fields_are_refused_before_they_take_memory():
    body = json.dumps({f"{k:x}": 0 for k in range(30_000)}).encode()
    tracemalloc.start()
    with pytest.raises(Rejected, match="0: extra inputs are not permitted; legal fields: depth_png"):
        parse_frame(PlanRequest, JSON, body)
    assert tracemalloc.get_traced_memory()[1] < 20 * len(body)
    tracemalloc.stop()


@pytest.mark.parametrize("value", [b'{"":0}', b"{}", b"[]", b"0"])
def test_a_body_of_many_small_values_takes_no_memory(value: bytes):
    body = b'{"grasps":[' + b",".join([value] * 1_000_000) + b"]}"
    tracemalloc.start()
    with pytest.raises(Rejected, match="more values than 4096 grasps have") as refused:
        parse_frame(ScoreRequest, JSON, body)
    assert refused.value.status == 413 and tracemalloc.get_traced_memory()[1] < 100_000
    tracemalloc.stop()


def test_the_most_grasps_are_no_more_values_than_are_read():
    grasps = [[0.5, 0.0, 0.02, 0.1]] * MAX_GRASPS
    asked, _ = parse_frame(ScoreRequest, JSON, text(grasps=grasps))
    assert len(asked.grasps) == MAX_GRASPS


def test_the_fields_of_a_place_request_become_grasp_and_target():
    body = {"grasp": [0.5, 0.1, 0.02, 0.3], "displacement": [0, 0, 0, 0], "centre_base": [0.5, 0.1, 0.01]}
    body["target"] = {"x": 0.4, "y": -0.1, "theta": 1.0}
    grasp, target = parse_json(PlaceRequest, json.dumps(body).encode()).parts()
    np.testing.assert_array_equal(grasp.as_vector(), body["grasp"])
    assert (target.x, target.y, target.theta) == (0.4, -0.1, 1.0)


def test_the_schema_is_whole_and_describes_both_forms():
    for kind, forms in ((PlanRequest, {JSON, NPZ}), (ScoreRequest, {JSON, NPZ}), (PlaceRequest, {JSON})):
        body = body_schema(kind)["requestBody"]
        assert set(body["content"]) == forms and "$ref" not in json.dumps(body)
        assert set(body["content"][JSON]["schema"]["properties"]) == set(kind.model_fields)
    assert set(values()) <= set(PlanRequest.model_fields) and png16()
