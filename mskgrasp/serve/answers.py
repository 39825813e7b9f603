"""Answers to requests: a plan with alternatives, predictions for grasps, a pose to place at."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.displacement_covariance import object_displacement_covariance
from mskgrasp.core.errors import MskgraspError, NoGraspFound, NoPartFound, TableTooHigh
from mskgrasp.core.grasp import PartView, centre_in_grasp_frame, to_object_displacement
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import place_pose
from mskgrasp.planning.planner import Planner, by_score, variance_score
from mskgrasp.planning.scoring import Scene, displacements, qualities
from mskgrasp.serve.rejection import Rejected, error_body
from mskgrasp.serve.requests import PlaceRequest, PlanRequest, ScoreRequest, parse_frame


def respond(planner: Planner, kind: str, content_type: str, body: bytes) -> tuple[int, bytes]:
    """Answer a request that holds a frame.

    Args:
        planner: The planner for the table in the frame.
        kind: "plan" or "score".
        content_type: Of the body.
        body: The request.

    Returns:
        HTTP status and JSON; whatever is wrong with the request becomes one too.
    """
    try:
        if kind == "plan":
            answer = plan_answer(planner, *parse_frame(PlanRequest, content_type, body))
        else:
            answer = score_answer(planner, *parse_frame(ScoreRequest, content_type, body))
        return 200, json.dumps(answer, allow_nan=False).encode()
    except Rejected as error:
        return error.status, error_body(str(error))
    except (NoPartFound, NoGraspFound, TableTooHigh) as error:
        return 422, error_body(str(error))
    except MskgraspError as error:
        return 400, error_body(str(error))
    except (
        Exception
    ):  # a defect must not end the worker: it is reported here, and the client learns that much
        traceback.print_exc(file=sys.stderr)
        return 500, error_body("the request met a defect of the server; its log has the details")


def plan_answer(planner: Planner, request: PlanRequest, frame: RgbdFrame) -> dict[str, Any]:
    """Plan a grasp: `GraspPlan.to_json`, the hand's pose, and alternatives, best first.

    Raises:
        NoPartFound: No part is detected.
        NoGraspFound: No candidate is good enough, or free.
        TableTooHigh: The table is seen over its stated height.
    """
    plan = planner.plan(frame, np.random.default_rng(request.seed))
    return plan.to_json() | {
        "T_base_tcp": plan.grasp.T_base_tcp.as_vector().tolist(),
        "alternatives": predictions(
            planner, frame, plan.view, _next_best(planner, plan, request.alternatives)
        ),
    }


def _next_best(planner: Planner, plan: GraspPlan, n: int) -> np.ndarray:
    """The n grasps (n, 4), or fewer, of the shortlist that would be chosen after the planned one."""
    grasps, found = plan.candidates.as_vector()[plan.shortlist], plan.qualities[plan.shortlist]
    good = np.flatnonzero(
        (found >= planner.config.least_quality) & (grasps != plan.grasp.as_vector()).any(axis=-1)
    )
    if planner.config.policy == "low_variance":
        good = good[by_score(found[good], plan.shortlist_scores[good], planner.config)]
    return grasps[good[:n]]


def score_answer(planner: Planner, request: ScoreRequest, frame: RgbdFrame) -> dict[str, Any]:
    """Predictions for the request's grasps, in its order, and the part as detected.

    Raises:
        NoPartFound: No part is detected.
        TableTooHigh: The table is seen over its stated height.
    """
    view = planner.view(frame)
    return {
        "grasps": predictions(planner, frame, view, np.array(request.grasps)),
        "part": {
            "centre_base": view.centre_base.tolist(),
            "size": view.size.tolist(),
            "gyration_radius": float(view.gyration_radius),
        },
    }


def predictions(
    planner: Planner, frame: RgbdFrame, view: PartView, grasps: np.ndarray
) -> list[dict[str, Any]]:
    """Predict quality, and displacement of the seen centre with its covariance, of grasps (n, 4).

    Returns:
        A mapping a grasp, of the names and units of `GraspPlan.to_json`; None where nothing is predicted.
    """
    chunk = planner.config.chunk_size
    scene = Scene.of(frame, view, planner.table_z, planner.models.device)
    quality = qualities(planner.models, scene, grasps, chunk)
    mean, variance = displacements(planner.models, scene, grasps, chunk)
    centre = centre_in_grasp_frame(view.centre_base, grasps)
    columns = {
        "grasp": grasps,
        "quality": quality,
        "displacement": to_object_displacement(mean[:, :4], centre),
        "displacement_cov": object_displacement_covariance(mean[:, :4], variance[:, :4], centre),
        "score": variance_score(mean, variance, grasps, view),
    }
    listed = {name: _plain(values) for name, values in columns.items()}
    return [{name: values[row] for name, values in listed.items()} for row in range(len(grasps))]


def _plain(values: np.ndarray) -> list[Any]:
    plain = values.astype(object)
    plain[~np.isfinite(values)] = None
    return plain.tolist()


def place_answer(request: PlaceRequest, lowest_grasp_z: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
    """The hand's pose at which the held part is at the target: as a grasp, and as ``T_base_tcp``."""
    grasp, target = request.parts()
    hand = place_pose(
        grasp,
        np.array(request.displacement),
        np.array(request.centre_base),
        target,
        lowest_grasp_z,
        drop=request.drop,
    )
    return {"hand": hand.as_vector().tolist(), "T_base_tcp": hand.T_base_tcp.as_vector().tolist()}
