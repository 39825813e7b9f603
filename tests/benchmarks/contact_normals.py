"""Contacts of pads and part, as both engines report them, against exact distances of the same convex shapes.

Two convex bodies that do not overlap have one least distance, and the normal of their contact is along it.
Each piece of the part is moved away from the pad along the reported normal until it is, by the reported
separation, `AWAY` from the pad; the normal is wrong where the least distance then has another direction.

Grasps are those of ``mskgrasp.validate --engine mujoco``, each tried once in both engines. The first table
compares grasps whose outcome differs with the others, the second shows the former one by one: the share of
the pads' force whose normal is wrong by more than `WRONG`, and the median of such angles and of the exact
distances of shapes that so press on each other.

Run: python -m tests.benchmarks.contact_normals
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import mujoco
import numpy as np
import torch
from sapien.physx import PhysxCpuSystem
from scipy.optimize import nnls

from hal.mujoco.panda import FINGERS
from hal.mujoco.simulation import Simulation
from mskgrasp.core.array_files import read_arrays
from mskgrasp.core.config import read_yaml
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.settings import Physics
from mskgrasp.core.shipped import config_file
from mskgrasp.parts import Part, chosen_names, find_part
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from mskgrasp.validate.body_scene import BodyScene
from mskgrasp.validate.mujoco_attempts import try_grasp
from mskgrasp.validate.outcomes import draw_grasps
from tasks import GraspDisplacementEnv
from tests.benchmarks.report import show

AWAY = 5e-5
"""Distance at which the direction of the least distance is looked at, m: twice an overlap in MuJoCo."""
WRONG = math.radians(5.0)
LEAST_FORCE = 1.0
"""Contacts that press by less, N, are left out."""
EVERY = 20
"""Steps between two looks."""
FAR = 3e-3
"""Displacements that differ by more than this, m, are far apart: the bound for nine tenths of the grasps."""
MUCH = 0.1
ENGINES = ("SAPIEN", "MuJoCo")
KINDS = ("S differs", "displacements differ by over 3 mm", "the others")
_BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_SUM = 1e4
"""Weight of the condition that the shares of the corners sum to one, to distances in mm."""


def least_distance(first: np.ndarray, second: np.ndarray) -> tuple[float, np.ndarray]:
    """Distance of the convex hulls of points (n, 3) and (m, 3), and the vector from second to first."""
    n, m = len(first), len(second)
    sums = _SUM * np.array([[1.0] * n + [0.0] * m, [0.0] * n + [1.0] * m])
    corners = 1e3 * np.hstack([first.T, -second.T])
    shares, _ = nnls(np.vstack([corners, sums]), np.array([0, 0, 0, _SUM, _SUM]), maxiter=1000)
    between = np.hstack([first.T, -second.T]) @ shares
    return float(np.linalg.norm(between)), between


@dataclass
class Tried:
    """A grasp in one engine.

    Attributes:
        failure: One of `FAILURES`.
        displacement: (4,) metres and radians, NaN where the grasp failed.
        force: Of every contact that was looked at, N.
        angle: Between the reported normal and the exact one, radians.
        distance: Exact distance of the shapes, m.
    """

    failure: str = ""
    displacement: np.ndarray = field(default_factory=lambda: np.full(4, np.nan))
    force: list[float] = field(default_factory=list)
    angle: list[float] = field(default_factory=list)
    distance: list[float] = field(default_factory=list)

    def add(
        self, piece: np.ndarray, pad: np.ndarray, normal: np.ndarray, separation: float, force: float
    ) -> None:
        """Add a contact; the normal points from the pad to the piece of the part."""
        if force < LEAST_FORCE:
            return
        length, between = least_distance(piece + (AWAY - separation) * normal, pad)
        cosine = float(between @ normal) / length if length else -1.0
        self.force.append(force)
        self.angle.append(math.acos(min(1.0, max(-1.0, cosine))))
        self.distance.append(least_distance(piece, pad)[0])

    @property
    def wrong(self) -> float:
        """Share of the force whose normal is wrong; 0 where the pads never pressed when it was looked at."""
        force = np.array(self.force)
        return float(force[np.array(self.angle) > WRONG].sum() / force.sum()) if len(force) else 0.0

    def row(self) -> list[str]:
        """Outcome, share, angle in degrees and distance in mm."""
        said = [self.failure.replace("none", "held"), f"{self.wrong:.0%}"]
        wrong = np.array(self.angle) > WRONG
        if not wrong.any():
            return [*said, "", ""]
        angle, distance = (float(np.median(np.array(one)[wrong])) for one in (self.angle, self.distance))
        return [*said, f"{math.degrees(angle):.0f}", f"{1e3 * distance:.2f}"]


def in_sapien(env: GraspDisplacementEnv, pose: np.ndarray, grasp: np.ndarray) -> Tried:
    """A grasp in the task."""
    env.reset(seed=0, options=dict(pose_base_obj=pose[None]))
    found, part = Tried(), env.contacts._body
    advance, system, taken = env.motion._advance, env.scene.px, 0
    assert isinstance(system, PhysxCpuSystem)

    def corners(body, shape) -> np.ndarray:
        local = _BOX * shape.half_size if hasattr(shape, "half_size") else shape.vertices * shape.scale
        placed = (body.entity.pose * shape.local_pose).to_transformation_matrix().astype(float)
        return local @ placed[:3, :3].T + placed[:3, 3]

    def step() -> None:
        nonlocal taken
        taken += 1
        if taken % EVERY:
            return advance()
        # The contacts of a step are those of the shapes where it begins.
        bodies = [part, *env.contacts._fingers]
        before = [[(one, corners(body, one)) for one in body.collision_shapes] for body in bodies]
        advance()
        placed = [pair for own in before for pair in own]
        for contact in system.get_contacts():
            if part not in contact.bodies or not any(
                body in env.contacts._fingers for body in contact.bodies
            ):
                continue
            shapes = [next(where for one, where in placed if one == shape) for shape in contact.shapes]
            first = contact.bodies[0] is part
            piece, pad = shapes if first else shapes[::-1]
            for point in contact.points:
                normal = np.asarray(point.normal, dtype=float) * (1 if first else -1)
                force = float(np.linalg.norm(point.impulse)) * env.motion.rate_hz
                found.add(piece, pad, normal, float(point.separation), force)
        return None

    with patch.object(env.motion, "_advance", step):
        outcome = env.attempt.run(torch.as_tensor(grasp[None]))
    found.failure = FAILURES[int(outcome["failure"][0])]
    found.displacement = outcome["displacement"][0].double().numpy()
    return found


def in_mujoco(part: Part, pose: np.ndarray, grasp: np.ndarray) -> Tried:
    """The same in the second engine."""
    found = Tried()
    step: Callable[..., None] = Simulation._step
    taken = 0

    def corners(simulation: Simulation, geom: int) -> np.ndarray:
        model, data = simulation.model, simulation.data
        mesh = model.geom_dataid[geom]
        if mesh < 0:
            local = _BOX * model.geom_size[geom]
        else:
            start = model.mesh_vertadr[mesh]
            local = model.mesh_vert[start : start + model.mesh_vertnum[mesh]].astype(float)
        return local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]

    def watched(simulation: Simulation, *state: np.ndarray) -> None:
        nonlocal taken
        step(simulation, *state)
        taken += 1
        if taken % EVERY:
            return
        model, data = simulation.model, simulation.data
        body, fingers = model.body("part0").id, [model.body(name).id for name in FINGERS]
        force = np.zeros(6)
        for i in range(data.ncon):
            contact = data.contact[i]
            first, second = (int(geom) for geom in contact.geom)
            bodies = [int(model.geom_bodyid[geom]) for geom in (first, second)]
            if body not in bodies or not any(one in fingers for one in bodies):
                continue
            mujoco.mj_contactForce(model, data, i, force)
            sign = 1.0 if bodies[1] == body else -1.0
            pair = (second, first) if bodies[1] == body else (first, second)
            piece, pad = (corners(simulation, geom) for geom in pair)
            found.add(piece, pad, sign * contact.frame[:3], float(contact.dist), float(force[0]))

    with patch.object(Simulation, "_step", watched):
        outcome = try_grasp(part, pose, grasp.astype(np.float64), Physics())
    found.failure, found.displacement = FAILURES[int(outcome["failure"])], outcome["displacement"]
    return found


def kind(sapien: Tried, mujoco: Tried) -> str:
    """How the outcomes of a grasp compare."""
    if (sapien.failure == "none") != (mujoco.failure == "none"):
        return KINDS[0]
    far = float(np.linalg.norm((sapien.displacement - mujoco.displacement)[:3]))
    return KINDS[1] if far > FAR else KINDS[2]


def compare(part: Part, folder: Path, n: int) -> Iterator[tuple[str, Tried, Tried]]:
    """Name of each grasp, and the grasp in SAPIEN and in MuJoCo."""
    (drawn,) = draw_grasps([part.folder], n, 0, folder, 1, lambda _: None)
    stored = read_arrays(drawn.file)
    scene = BodyScene(Physics(), part)
    for k, (pose, grasp) in enumerate(zip(stored["pose"].astype(np.float64), stored["grasp"], strict=True)):
        here, there = in_sapien(scene.env, pose, grasp), in_mujoco(part, pose, grasp)
        if "unsettled" not in (here.failure, there.failure):
            yield f"{part.name} ({k})", here, there
    scene.close()


def tables(tried: Sequence[tuple[str, Tried, Tried]]) -> list[Table]:
    """Grasps by how their outcomes compare, and those that differ one by one."""
    kinds = np.array([kind(sapien, mujoco) for _, sapien, mujoco in tried])
    wrong = np.array([[one.wrong for one in pair] for _, *pair in tried]).reshape(-1, 2)
    whole = [
        (name, int(own.sum()), *(f"{np.mean(wrong[own, k] > MUCH):.0%}" for k in range(2)))
        for name in KINDS
        if (own := kinds == name).any()
    ]
    header = ("grasps", "n", *(f"{engine}: over {MUCH:.0%} of the force" for engine in ENGINES))
    columns = ("wrong normals", "by, deg", "distance, mm")
    each = ("grasp", *(name for engine in ENGINES for name in (engine, *columns)))
    differing = [pair for pair, own in zip(tried, kinds, strict=True) if own != KINDS[2]]
    rows = [(name, *sapien.row(), *mujoco.row()) for name, sapien, mujoco in differing]
    return [
        Table(caption="Grasps with wrong normals", header=header, rows=whole),
        Table(caption="Grasps that differ", header=each, rows=rows),
    ]


def main() -> None:
    """Prints both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    default = read_yaml(config_file("validate/default.yaml"))
    parser.add_argument("--parts", nargs="+", default=default["parts"])
    parser.add_argument("--grasps-per-part", type=int, default=14)
    parser.add_argument("--out", type=Path, help="folder for report.json")
    given = parser.parse_args()
    tried = []
    with TemporaryDirectory() as folder:
        for name in progress(chosen_names(given.parts), title="parts", unit="part"):
            tried += compare(find_part(name), Path(folder), given.grasps_per_part)
    show(tables(tried), given.out)


if __name__ == "__main__":
    main()
