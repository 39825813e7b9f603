"""Files of trials: the frame before the grasp, the plan, and the frame after it, if any."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.array_files import read_arrays, write_arrays
from mskgrasp.core.errors import BadDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp, PartView
from mskgrasp.dataset import depth_to_u16, u16_to_depth
from mskgrasp.planning.grasp_plan import GraspPlan, PlannedBy

SCHEMA_VERSION = 5
FOLDER = "trials"
_ARRAYS = (
    "grasp_displacement", "grasp_displacement_cov", "swing", "swing_var", "qualities", "shortlist",
    "shortlist_scores",
)  # fmt: skip
_NUMBERS = ("quality", "score")


def trial_file(run: Path, key: str) -> Path:
    """Path of the trial of a key."""
    return run / FOLDER / f"{key}.npz"


def write_trial(path: Path, frame: RgbdFrame, plan: GraspPlan | None, after: RgbdFrame | None) -> None:
    """Write a trial atomically; fine colour images are kept where there is a frame after the grasp.

    Raises:
        OSError: The disk is full or not writable.
    """
    arrays: dict[str, Any] = {"schema_version": SCHEMA_VERSION}
    arrays |= _frame_arrays("before", frame, fine=after is not None)
    if after is not None:
        arrays |= _frame_arrays("after", after, fine=True)
    if plan is not None:
        arrays |= {f"plan_{name}": getattr(plan, name) for name in (*_ARRAYS, *_NUMBERS)}
        arrays["plan_planned_by"] = plan.planned_by
        arrays["plan_grasp"] = plan.grasp.as_vector()
        arrays["plan_candidates"] = plan.candidates.as_vector().astype(np.float32)
        view = plan.view
        arrays |= {
            "view_centre_base": view.centre_base,
            "view_T_base_box": np.asarray(view.T_base_box.as_vector()),
            "view_size": view.size,
            "view_gyration_radius": view.gyration_radius,
            "view_table_z": view.table_z,
            "view_table_offset": view.table_offset,
        }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, **arrays)


def read_trial(path: Path) -> tuple[RgbdFrame, GraspPlan | None, RgbdFrame | None]:
    """Read a file of `write_trial`; candidates are stored in single precision.

    Raises:
        BadDataset: The file is missing, damaged, or of another schema.
    """
    try:
        arrays = read_arrays(path)
        if int(arrays["schema_version"]) != SCHEMA_VERSION:
            raise BadDataset(
                f"{path} has schema version {int(arrays['schema_version'])}, legal: {SCHEMA_VERSION}"
            )
        plan = _plan(arrays) if "plan_grasp" in arrays else None
        after = _frame("after", arrays) if "after_depth_u16_dmm" in arrays else None
        return _frame("before", arrays), plan, after
    except FileNotFoundError as error:
        raise BadDataset(f"no {path}: the trial's file was removed; run it again in another --out") from error
    except (OSError, ValueError, LookupError, TypeError, AttributeError, OverflowError) as error:
        raise BadDataset(f"{path} is damaged ({' '.join(str(error).split())}); copy it again") from error


def _frame_arrays(name: str, frame: RgbdFrame, *, fine: bool) -> dict[str, Any]:
    arrays = {
        f"{name}_depth_u16_dmm": depth_to_u16(frame.depth),
        f"{name}_colour": frame.colour,
        f"{name}_intrinsics": np.asarray(frame.intrinsics, dtype=np.float64),
        f"{name}_T_base_camera": np.asarray(frame.T_base_camera.as_vector(), dtype=np.float64),
        f"{name}_timestamp_s": frame.timestamp_s,
        f"{name}_serial": frame.serial,
    }
    if fine and frame.fine_colour is not None:
        arrays[f"{name}_fine_colour"] = frame.fine_colour
    return arrays


def _frame(name: str, arrays: dict[str, np.ndarray]) -> RgbdFrame:
    depth, colour = arrays[f"{name}_depth_u16_dmm"], arrays[f"{name}_colour"]
    if depth.dtype != np.uint16 or depth.ndim != 2 or colour.shape != (*depth.shape, 3):
        raise ValueError(
            f"depth of shape {depth.shape} and type {depth.dtype}, colour of shape {colour.shape}"
        )
    return RgbdFrame(
        colour=colour,
        depth=u16_to_depth(depth),
        intrinsics=arrays[f"{name}_intrinsics"].reshape(3, 3),
        T_base_camera=Pose.from_vector(arrays[f"{name}_T_base_camera"].reshape(7)),
        timestamp_s=float(arrays[f"{name}_timestamp_s"]),
        serial=str(arrays[f"{name}_serial"]),
        fine_colour=arrays.get(f"{name}_fine_colour"),
    )


def _planned_by(arrays: dict[str, np.ndarray]) -> PlannedBy:
    stored = str(arrays["plan_planned_by"])
    for one in get_args(PlannedBy):
        if one == stored:
            return one
    raise ValueError(f"planned by '{stored}'")


def _plan(arrays: dict[str, np.ndarray]) -> GraspPlan:
    rest: dict[str, Any] = {name: arrays[f"plan_{name}"] for name in _ARRAYS}
    rest |= {name: float(arrays[f"plan_{name}"]) for name in _NUMBERS}
    return GraspPlan(
        view=PartView(
            centre_base=arrays["view_centre_base"].reshape(3),
            T_base_box=Pose.from_vector(arrays["view_T_base_box"].reshape(7)),
            size=arrays["view_size"].reshape(3),
            gyration_radius=float(arrays["view_gyration_radius"]),
            table_z=float(arrays["view_table_z"]),
            table_offset=float(arrays.get("view_table_offset", 0.0)),
        ),
        grasp=Grasp.from_vector(arrays["plan_grasp"].reshape(4)),
        candidates=Grasp.from_vector(arrays["plan_candidates"].astype(np.float64).reshape(-1, 4)),
        seconds={},
        planned_by=_planned_by(arrays),
        **rest,
    )
