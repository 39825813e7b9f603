"""Predicted quality and displacement of the grasps of an isaac_grasp file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.benchmark.config import BenchmarkConfig
from mskgrasp.core.displacement_covariance import (
    half_turned_covariance,
    half_turned_displacement,
    object_displacement_covariance,
)
from mskgrasp.core.errors import NoPartFound, UsageError, printable
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import centre_in_grasp_frame, to_object_displacement
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionNoise, Overhead, Physics
from mskgrasp.learning.grasp_models import Models, load_models
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.store import read_record
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.certified import half_turned, rest_frame, to_base
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import part_name
from mskgrasp.planning.isaac_grasp import (
    MOST_TILT,
    TopDownGrasp,
    read_isaac_grasp,
    top_down_grasp,
    write_scored,
)
from mskgrasp.planning.scoring import Scene, displacements, qualities
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import note
from mskgrasp.simulation.repeats import captured_frame, place_part
from mskgrasp.simulation.resting import resting_of


def score_file(config: BenchmarkConfig, path: Path) -> None:
    """Score the top-down grasps of a file, and write them with confidence, displacement and covariance.

    Raises:
        UsageError: No part is named, or the file is not of the format.
        MskgraspError: The part or the model cannot be used.
    """
    if not config.part:
        raise UsageError("--grasps needs --part: the part that the grasps are of")
    read = read_isaac_grasp(path)
    part = find_part(part_name(config.part))
    models = load_models(config.models)
    origin = np.zeros(3)
    if config.grasps_origin == "mesh":
        origin = np.array(read_record(part.folder)["centroid_in_source"], dtype=np.float64)
    stands = resting_of(part).stands
    found: dict[str, TopDownGrasp] = {}
    for name, pose in read.T_mesh_tcp.items():
        T_obj_tcp = Pose(position=np.asarray(pose.position) - origin, quat_wxyz=pose.quat_wxyz)
        grasp = top_down_grasp(part, T_obj_tcp, stands)
        if grasp is None:
            note(
                f"left out: {name} is tilted by more than {np.degrees(MOST_TILT):g} degrees, or touches the "
                f"table, in every resting pose of '{part.name}'"
            )
        else:
            found[name] = grasp
    scores = score(part, models, found) if found else {}
    make_folder(config.folder)
    out = config.folder / f"{path.stem}.scored.yaml"
    write_scored(out, read, scores)
    print(f"scored {len(scores)} of {len(read.T_mesh_tcp)} grasps of {part.name}")
    for name, one in sorted(scores.items(), key=lambda item: -item[1]["confidence"]):
        print(f"  {printable(name)}: {_line(one)}")
    print(f"wrote {out}")


def _line(one: Mapping[str, Any]) -> str:
    moved = np.array(one["displacement"])
    text = (
        f"quality {one['confidence']:.2f}, moves by {1e3 * np.hypot(*moved[:2]):.1f} mm and "
        f"{np.degrees(moved[3]):.1f} degrees"
    )
    if "displacement_cov" not in one:
        return text
    cov = np.array(one["displacement_cov"])
    return (
        f"{text}, standard deviation {1e3 * np.sqrt(np.trace(cov[:2, :2])):.1f} mm and "
        f"{np.degrees(np.sqrt(cov[3, 3])):.1f} degrees"
    )


def score(part: Part, models: Models, grasps: Mapping[str, TopDownGrasp]) -> dict[str, dict[str, Any]]:
    """Predict the outcome of grasps from an image of the part in each grasp's resting pose.

    Args:
        part: The part.
        models: The networks.
        grasps: By name.

    Returns:
        By name: ``confidence``, the predicted probability of success; ``displacement`` (4,) of the part's
        origin in the hand, metres and radians along the axes of the grasp, those of the hand in the file with
        y and z reversed; ``displacement_cov`` (4, 4), left out where the networks predict no variance;
        ``resting``, the index of the resting pose. Poses in which the camera does not see the part are left
        out, and named.
    """
    from mskgrasp.simulation.shard import Simulator  # loads the simulator

    scores: dict[str, dict[str, Any]] = {}
    simulator = Simulator(Physics(), Overhead(), ExecutionNoise())
    try:
        env = simulator.load(str(part.folder))
        for resting in sorted({one.resting for one in grasps.values()}):
            some = {name: one for name, one in grasps.items() if one.resting == resting}
            which = list(env.standing[0].numbers).index(resting)
            middle = np.array([REGION[0] + REGION[1], REGION[2] + REGION[3]]) / 2
            lying = place_part(env, which, middle, 0.0)
            try:
                scores |= _scored(part, models, captured_frame(env), lying, some)
            except NoPartFound:  # too flat or thin
                note(f"left out: {', '.join(some)}: in pose {resting} the camera does not see the part")
    finally:
        simulator.close()
    return scores


def _scored(
    part: Part, models: Models, frame: RgbdFrame, lying: Pose, grasps: Mapping[str, TopDownGrasp]
) -> dict[str, dict[str, Any]]:
    view = view_part(
        frame.depth, frame.intrinsics, frame.T_base_camera, table_z=TABLE_Z, region=REGION, alone=True
    )
    scene = Scene.of(frame, view, TABLE_Z, models.device)
    resting = next(iter(grasps.values())).resting
    T_base_rest = rest_frame(lying, part.resting.quat_wxyz[resting])
    vectors = to_base(T_base_rest, np.stack([one.grasp for one in grasps.values()]), TABLE_Z)
    chunk = PlannerConfig().chunk_size
    quality = qualities(models, scene, vectors, chunk)
    mean, variance = displacements(models, scene, vectors, chunk)
    scores = {}
    for row, (name, one) in enumerate(grasps.items()):
        sign = one.sign * half_turned(T_base_rest, one.grasp, vectors[row])
        origin = centre_in_grasp_frame(np.asarray(lying.position), vectors[row])
        moved = half_turned_displacement(to_object_displacement(mean[row, :4], origin), sign)
        scores[name] = dict(
            confidence=round(float(quality[row]), 4), displacement=moved.tolist(), resting=resting
        )
        if np.isfinite(variance[row, :4]).all():
            covariance = object_displacement_covariance(mean[row, :4], variance[row, :4], origin)
            scores[name]["displacement_cov"] = half_turned_covariance(covariance, sign).tolist()
    return scores
