"""The same grasps simulated under several settings."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import logging
import time
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path

import gymnasium
import numpy as np
import torch

from mskgrasp.core.array_files import read_arrays, write_arrays
from mskgrasp.core.errors import BadDataset, BadPart
from mskgrasp.core.settings import Physics
from mskgrasp.parts import read_part
from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.simulation.shard import draw_attempt
from mskgrasp.simulation.versions import SIMULATION_VERSION, versions
from mskgrasp.validate.altered_part import mesh_rests, resting_start
from mskgrasp.validate.config import Setting, drawn_physics
from tasks import GraspDisplacementEnv
from tasks.scene.renderer import render_backend

KEPT = ("success", "failure", "settled", "displacement", "tilt", "penetration", "fastest", "seconds")


@dataclass(frozen=True, kw_only=True)
class Outcomes:
    """Outcomes of n grasps under one setting, in the order of the grasps.

    Attributes:
        success: (n,) bool.
        failure: (n,) index into `mskgrasp.core.grasp.FAILURES`.
        settled: (n,) bool, the part was at rest before anything touched it; otherwise the other values mean
            nothing.
        displacement: (n, 4) object displacement, NaN where not successful.
        tilt: (n,) rad.
        penetration: (n,) deepest overlap of finger and part, m.
        fastest: (n,) greatest speed of the part, m/s.
        seconds: (n,) simulated time.
        cpu_seconds: (n,) processor time.
        part: (n,) name of the part.
        index: (n,) number of the grasp among those of its part.
    """

    success: np.ndarray
    failure: np.ndarray
    settled: np.ndarray
    displacement: np.ndarray
    tilt: np.ndarray
    penetration: np.ndarray
    fastest: np.ndarray
    seconds: np.ndarray
    cpu_seconds: np.ndarray
    part: np.ndarray
    index: np.ndarray

    def rows(self, which: np.ndarray) -> Outcomes:
        """Some of the grasps: (n,) bool or indices."""
        return Outcomes(**{field.name: getattr(self, field.name)[which] for field in fields(self)})

    def of(self, parts: Collection[str], n: int) -> Outcomes:
        """The first n grasps of each of some parts."""
        return self.rows(np.isin(self.part, list(parts)) & (self.index < n))


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A part and the grasps that were drawn for it.

    Attributes:
        part: The part's name.
        folder: The part's folder.
        file: npz with ``pose`` (n, 7), ``T_base_obj`` at the start, and ``grasp`` (n, 4), base frame.
    """

    part: str
    folder: Path
    file: Path


def draw_grasps(
    folders: Sequence[Path], n: int, seed: int, out: Path, workers: int, report: Callable[[int], None]
) -> list[Drawn]:
    """Draw n starts and grasps of each part as the collector does; those that were drawn before are kept.

    Raises:
        BadPart: The camera sees a part in none of its poses.
        WorkerFailed: Processes died again and again.
    """
    drawn = []
    for folder in folders:
        part = read_part(folder)
        name = f"{part.name}-{part.content_hash[:12]}-{SIMULATION_VERSION}-{seed}-{n}.npz"
        drawn.append(Drawn(part=part.name, folder=folder, file=out / "grasps" / name))
    jobs = [(str(one.folder), n, seed, str(one.file)) for one in drawn if not one.file.exists()]
    _in_parallel(_draw, jobs, workers, report)
    return drawn


def run_settings(
    settings: Sequence[Setting],
    drawn: Sequence[Drawn],
    altered: Mapping[str, Mapping[str, Path]],
    out: Path,
    workers: int,
    report: Callable[[int], None],
) -> dict[str, Outcomes]:
    """Try the drawn grasps under every setting; outcomes stored in ``out`` are read.

    Args:
        settings: Tried in parallel with the parts.
        drawn: The grasps.
        altered: For settings with altered parts the folder of each by the part's name; others are left out.
        out: Folder of the stored outcomes.
        workers: Processes.
        report: Called with the number of grasps that were tried.

    Raises:
        WorkerFailed: Processes died again and again.
    """
    trials = {setting.name: _trials(setting, drawn, altered.get(setting.name), out) for setting in settings}
    jobs = []
    for trial in (trial for own in trials.values() for trial in own):
        if trial.file.exists():
            report(len(_stored(trial.file)["success"]))
        else:
            jobs.append((trial, trial.file))
    # The finest first: the longest job must not be the last to start.
    jobs.sort(key=lambda job: -job[0].setting.physics.rate_hz * job[0].setting.physics.position_iterations)
    _in_parallel(_try_grasps, jobs, workers, report)
    return {name: _read(own) for name, own in trials.items()}


@dataclass(frozen=True, kw_only=True)
class _Trial:
    """The grasps of one part under one setting; `folder` is that of the simulated part."""

    setting: Setting
    drawn: Drawn
    folder: Path
    file: Path


def _trials(
    setting: Setting, drawn: Sequence[Drawn], altered: Mapping[str, Path] | None, out: Path
) -> list[_Trial]:
    found = []
    for one in drawn:
        folder = one.folder if altered is None else altered.get(one.part)
        if folder is not None:
            file = _outcome_file(out, setting, one, folder)
            found.append(_Trial(setting=setting, drawn=one, folder=folder, file=file))
    return found


def _in_parallel(
    function: Callable[..., int], jobs: Sequence[tuple], workers: int, report: Callable[[int], None]
) -> None:
    # In separate processes even with one worker: every job loads its own scenes.
    work = Work(_caller, function, name=lambda job: Path(job[-1]).name)
    for tried in results(work, jobs, workers, apart=True):
        report(tried)


@contextmanager
def _caller(function: Callable[..., int]) -> Iterator[Callable[[tuple], Iterator[int]]]:
    def work(job: tuple) -> Iterator[int]:
        yield function(*job)

    yield work


def _make_env(folder: str, physics: Physics, renderer: str) -> tuple[gymnasium.Env, GraspDisplacementEnv]:
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
    made = gymnasium.make(
        "GraspDisplacement-v1",
        parts=[folder],
        obs_mode="none",
        render_backend=renderer,
        physics=physics.model_dump(),
    )
    env = made.unwrapped
    assert isinstance(env, GraspDisplacementEnv)
    return made, env


def _draw(folder: str, n: int, seed: int, file: str) -> int:
    made, env = _make_env(folder, Physics(), render_backend())
    poses, grasps = [], []
    attempt = 0
    while len(grasps) < n and attempt < 2 * n:
        _, grasp = draw_attempt(env, env.parts[0].name, seed, attempt)
        attempt += 1
        if grasp is not None:
            grasps.append(grasp[0])
            poses.append(env.part_pose().as_vector()[0].numpy())
    made.close()
    if not grasps:
        raise BadPart(f"{env.parts[0].name}: the camera sees it in none of its poses: leave it out of parts")
    _write(Path(file), pose=np.stack(poses), grasp=np.stack(grasps))
    return len(grasps)


def _try_grasps(trial: _Trial, file: Path) -> int:
    torch.set_num_threads(1)
    setting = trial.setting
    stored = _stored(trial.drawn.file)
    poses, grasps = stored["pose"].astype(np.float64), stored["grasp"]
    # The direction of the shift is the same under every setting: it is part of the start.
    angle = np.random.default_rng([len(grasps), 1]).uniform(0, 2 * np.pi, len(grasps))
    poses[:, 0] += setting.shift * np.cos(angle)
    poses[:, 1] += setting.shift * np.sin(angle)
    poses, grasps = poses[: setting.n], grasps[: setting.n]
    if setting.engine == "mujoco":
        from mskgrasp.validate.mujoco_attempts import try_grasps

        _write(file, **try_grasps(trial.folder, poses, grasps, setting.physics))
        return len(grasps)
    rows: dict[str, list[np.ndarray]] = {name: [] for name in (*KEPT, "cpu_seconds")}
    made, env = _make_env(str(trial.folder), setting.physics, "none")
    for k, (pose, grasp) in enumerate(zip(poses, grasps, strict=True)):
        if setting.ranges:
            made.close()
            rng = np.random.default_rng([zlib.crc32(trial.drawn.part.encode()), k])
            physics = drawn_physics(setting.physics, setting.ranges, rng)
            made, env = _make_env(str(trial.folder), physics, "none")
        if setting.hulls:
            pose = resting_start(pose, env.standing[0].poses)
        elif setting.rest == "mesh":
            pose = resting_start(pose, mesh_rests(env.parts[0]))
        began = time.process_time()
        env.reset(seed=0, options=dict(pose_base_obj=pose[None]))
        outcome = env.attempt.run(torch.as_tensor(grasp[None]))
        rows["cpu_seconds"].append(np.asarray(time.process_time() - began))
        for name in KEPT:
            rows[name].append(outcome[name][0].numpy())
    made.close()
    _write(file, **{name: np.stack(values) for name, values in rows.items()})
    return len(grasps)


def _write(file: Path, **arrays: np.ndarray) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(file, **arrays)


def _stored(file: Path) -> dict[str, np.ndarray]:
    try:
        return read_arrays(file)
    except ValueError as error:
        raise BadDataset(f"{file} is damaged ({error}); delete it, and it is made again") from error


def _outcome_file(out: Path, setting: Setting, drawn: Drawn, folder: Path) -> Path:
    grasps = hashlib.sha256(drawn.file.read_bytes()).hexdigest()
    part = read_part(folder)
    # The name is for people. The versions, so that outcomes of another simulation are not read as this one's.
    what = {field.name: getattr(setting, field.name) for field in fields(setting) if field.name != "name"}
    what["physics"] = setting.physics.model_dump()
    if setting.engine == "mujoco":
        what["version"] = importlib.metadata.version("mujoco")
    text = json.dumps([what, part.content_hash, grasps, versions()])
    return out / "outcomes" / f"{part.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.npz"


def _read(trials: Sequence[_Trial]) -> Outcomes:
    pieces: dict[str, list[np.ndarray]] = {field.name: [] for field in fields(Outcomes)}
    for trial in trials:
        stored = _stored(trial.file)
        for name in (*KEPT, "cpu_seconds"):
            pieces[name].append(stored[name])
        n = len(stored["success"])
        pieces["part"].append(np.repeat(trial.drawn.part, n))
        pieces["index"].append(np.arange(n))
    if not trials:
        return Outcomes(**{name: np.zeros((0, 4) if name == "displacement" else 0, bool) for name in pieces})
    return Outcomes(**{name: np.concatenate(values) for name, values in pieces.items()})
