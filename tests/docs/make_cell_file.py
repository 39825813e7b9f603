"""Page of all keys of a cell's file. Run ``python -m tests.docs.make_cell_file``."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import yaml
from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from hal.config import MeasuredGrip, SimulatedCellConfig, TableError, WorkspaceConfig
from hal.franka.config import FrankaArmConfig, PandaPyArmConfig
from hal.keep_out_config import BoxConfig, CapsuleConfig, SphereConfig
from hal.kinect2.config import Kinect2Config, PinholeIntrinsics
from hal.mujoco.config import MujocoCellConfig, MujocoPhysics
from hal.replay.config import (
    RecordedCellConfig,
    ReplayArmConfig,
    ReplayCameraConfig,
    ReplayCellConfig,
    Tolerances,
)
from hal.sensor_noise import SensorNoise
from hal.sim.config import SapienCameraConfig, SapienCellConfig
from mskgrasp.core.settings import Overhead, Physics, Tape
from tests.docs.make_reference import parse, string_after
from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "cell_file.md"
OF_ATTEMPTS = {
    "coarse_rate_hz", "approach_clearance", "descend_speed", "lift_speed", "lift_height", "hold_s",
    "skip_air", "finger_force",
}  # fmt: skip
"""Physics of the attempts that a dataset is made of. In a cell, programs command speeds and heights."""

INTRODUCTION = """\
# The file of a cell

Made from the configurations by `make reference`; do not edit. All keys of the YAML file that
[`hal.open_cell`](cells.md) and `--cell` read: their defaults, legal values and meaning. SI units. Unknown
keys are refused. Files to start from are in `configs/cells`; for a [real cell](real_cell.md) copy
`panda_kinect2.yaml`.

`type` selects the backend: `devices`, `sapien`, `mujoco`, `replay`, `recorded`, or one of
[another package](backends.md).
"""

SECTIONS: tuple[tuple[str, str, tuple[tuple[str, type[BaseModel]], ...]], ...] = (
    (
        "type: devices",
        "An arm and a camera, each chosen by its `driver`, and a table: `arm`, `camera` and `workspace`.",
        (
            ("`arm` with `driver: panda_py` or `franky`", FrankaArmConfig),
            ("`arm` with `driver: panda_py`, in addition", PandaPyArmConfig),
            ("`arm` with `driver: replay`", ReplayArmConfig),
            ("`camera` with `driver: kinect2`", Kinect2Config),
            ("`camera.intrinsics`, by serial number", PinholeIntrinsics),
            ("`camera` with `driver: sapien`", SapienCameraConfig),
            ("`camera` with `driver: replay`", ReplayCameraConfig),
            ("`workspace`", WorkspaceConfig),
            ("`workspace.measured_grip`", MeasuredGrip),
        ),
    ),
    (
        "type: sapien, type: mujoco",
        "Simulated cells. Both have the keys of the first table. Keys of `physics` that only attempts of a "
        "dataset use, such as speeds of the hand, are left out.",
        (
            ("both", SimulatedCellConfig),
            ("`type: sapien`, in addition", SapienCellConfig),
            ("`type: mujoco`, in addition", MujocoCellConfig),
            ("`camera`, and `overhead` of `driver: sapien`", Overhead),
            ("`noise`", SensorNoise),
            ("`table_error`", TableError),
            ("`tape`", Tape),
            ("`physics` of SAPIEN", Physics),
            ("`physics` of MuJoCo", MujocoPhysics),
        ),
    ),
    (
        "keep_out",
        "A list, of a simulated cell or under `workspace`; each entry has one of three shapes.",
        (("`shape: sphere`", SphereConfig), ("`shape: capsule`", CapsuleConfig), ("`shape: box`", BoxConfig)),
    ),
    (
        "type: replay, type: recorded",
        "[Recordings](replay.md).",
        (
            ("`type: replay`", ReplayCellConfig),
            ("`type: recorded`", RecordedCellConfig),
            ("`tolerances`", Tolerances),
        ),
    ),
)


def cell_file() -> str:
    """The page as today's configurations give it."""
    blocks = [INTRODUCTION]
    for title, words, models in SECTIONS:
        blocks.append(f"## {title}\n\n{words}\n")
        for heading, model in models:
            bases = [other for _, other in models if other is not model and issubclass(model, other)]
            inherited = {name for base in bases for name in base.model_fields}
            if model is Physics:
                inherited |= OF_ATTEMPTS
            fields = {name: field for name, field in model.model_fields.items() if name not in inherited}
            rows = [row(name, field, model) for name, field in fields.items() if not _in_heading(field)]
            if rows:
                table = ["| key | default | legal | meaning |", "|---|---|---|---|", *rows]
                blocks.append(f"### {heading}\n\n" + "\n".join(table) + "\n")
    return "\n".join(blocks)


def _in_heading(field: FieldInfo) -> bool:
    """Whether a key has one legal value, such as ``driver: kinect2``, which the heading shows."""
    return get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1


def row(name: str, field: FieldInfo, model: type[BaseModel]) -> str:
    """A key's row of the table."""
    cells = (f"`{name}`", default_of(field), legal_of(field), docstring_of(model, name))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def default_of(field: FieldInfo) -> str:
    """A default as it is written in the file; a section's own are in its table."""
    if field.is_required():
        return "needed"
    value = field.default
    if isinstance(value, BaseModel):
        return "below"
    text = yaml.safe_dump(_plain(value), default_flow_style=True, width=1000).removesuffix("...\n").strip()
    return f"`{text}`"


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value


def legal_of(field: FieldInfo) -> str:
    """Options of a choice, or bounds of a number; empty where any value of the kind is legal."""
    for part in (field.annotation, *get_args(field.annotation)):
        if get_origin(part) is Literal:
            return ", ".join(f"`{one}`" for one in get_args(part))
    signs = {Gt: ("gt", ">"), Ge: ("ge", ">="), Lt: ("lt", "<"), Le: ("le", "<=")}
    bounds, metadata = [], list(field.metadata)
    for item in get_args(field.annotation)[:1]:  # all items of a sequence have the bounds of the first
        metadata += [
            one for info in getattr(item, "__metadata__", ()) for one in getattr(info, "metadata", ())
        ]
    for one in metadata:
        if isinstance(one, MinLen):
            bounds.append("not empty")
        for kind, (attribute, sign) in signs.items():
            if isinstance(one, kind):
                bound = getattr(one, attribute)
                bounds.append(f"{sign} {'2^63' if bound == 2**63 else f'{bound:g}'}")
    return ", ".join(bounds)


def docstring_of(model: type[BaseModel], name: str) -> str:
    """The docstring below a field, in the class that declares it, on one line."""
    for cls in model.__mro__:
        if name in cls.__dict__.get("__annotations__", {}):
            file = sys.modules[cls.__module__].__file__
            assert file is not None
            body = next(
                node.body
                for node in parse(Path(file)).body
                if isinstance(node, ast.ClassDef) and node.name == cls.__name__
            )
            for number, node in enumerate(body):
                if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == name:
                    return re.sub(r"``([^`]+)``", r"`\1`", " ".join(string_after(body, number).split()))
    return ""


if __name__ == "__main__":
    PAGE.write_text(cell_file(), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
