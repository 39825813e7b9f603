"""A stored attempt, simulated again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from mskgrasp.core.config import check_config
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.seeds import scene_seeds
from mskgrasp.core.settings import ExecutionNoise, Overhead, Physics
from mskgrasp.dataset import ShardInfo
from mskgrasp.dataset.attempts import physics_of
from mskgrasp.parts import Part
from mskgrasp.simulation.shard import Simulator, lies_as
from mskgrasp.view.motion import Motion
from tasks import GraspDisplacementEnv


@dataclass(frozen=True, kw_only=True)
class Replay:
    """An attempt as it went this time.

    Attributes:
        motion: Of arm and part.
        failure: Its name in `FAILURES`; "none" where the part was lifted.
        displacement: (4,) of the part's origin, axes of the grasp frame; NaN where it was not lifted.
    """

    motion: Motion
    failure: str
    displacement: np.ndarray


class AttemptSimulator:
    """Simulator of attempts one at a time; built for the settings of a shard when they are first needed."""

    def __init__(self) -> None:
        self._simulator: Simulator | None = None
        self._settings: tuple[Physics, ExecutionNoise] | None = None

    def simulate(self, part: Part, info: ShardInfo, row: Mapping[str, np.ndarray]) -> Replay:
        """Simulate an attempt again, in a fresh scene.

        The seed determines the errors of arm and gripper, of an attempt whose number is known.

        Args:
            part: The part.
            info: Settings of its shard.
            row: Its columns ``grasp`` (4,), ``pose_base_obj`` (7,), ``attempt`` and ``draw``.

        Raises:
            BadConfig: The shard's settings are not valid here.
        """
        physics = check_config(Physics, physics_of(info), "physics of the shard")
        noise = check_config(ExecutionNoise, info.noise, "noise of the shard")
        if self._simulator is None or self._settings != (physics, noise):
            self.close()
            self._simulator, self._settings = Simulator(physics, Overhead(), noise), (physics, noise)
        env = self._simulator.load(str(part.folder))
        number = int(row["attempt"])
        seed = 0 if number < 0 else scene_seeds(info.seed, info.part, number, int(row["draw"]))[0]
        lay = np.asarray(row["pose_base_obj"], np.float64)
        env.begin_episode(seed)
        if not lies_as(env, lay):  # another formula drew it, or its number is not known
            env.begin_episode(seed, lay[None])
        return _recorded(env, np.asarray(row["grasp"], np.float32)[None])

    def close(self) -> None:
        """Free the simulation."""
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None


def _recorded(env: GraspDisplacementEnv, grasp: np.ndarray) -> Replay:
    """Try a grasp (1, 4) and record the motion."""
    moments: list[tuple[float, np.ndarray, np.ndarray]] = []
    motion, judged = env.motion, env.motion.watch

    def record(seconds: float) -> None:
        if judged is not None:
            judged(seconds)
        qpos = env.agent.robot.get_qpos()[0].cpu().numpy().astype(np.float64)
        moments.append((seconds, qpos, env.part_pose().as_vector()[0].cpu().numpy().astype(np.float64)))

    motion.watch = record
    try:
        outcome = env.try_grasp(torch.as_tensor(grasp, device=env.device))
    finally:
        motion.watch = judged
    seconds, qpos, poses = (np.array(values) for values in zip(*moments, strict=True))
    return Replay(
        motion=Motion(
            seconds=seconds - seconds[0],
            joints=qpos[:, :7],
            width=qpos[:, 7:9].sum(axis=1),
            T_base_obj=Pose.from_vector(poses),
        ),
        failure=FAILURES[int(outcome["failure"][0])],
        displacement=outcome["displacement"][0].cpu().numpy().astype(np.float64),
    )
