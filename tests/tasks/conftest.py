from __future__ import annotations

import logging
from collections.abc import Callable, Iterator

import gymnasium
import numpy as np
import pytest
import torch

from mskgrasp.parts import Part
from tasks import GraspDisplacementEnv
from tests.boxes import make_box

SIZE = (0.04, 0.02, 0.03)
Attempt = Callable[..., dict[str, torch.Tensor]]


@pytest.fixture(scope="session")
def boxes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Part]:
    """Boxes 4 x 2 x 3 cm of several masses, and one wider than the hand opens."""
    cache = tmp_path_factory.mktemp("boxes")
    made = {name: make_box(cache, name, SIZE, mass) for name, mass in MASSES.items()}
    return dict(made, wide=make_box(cache, "wide", (0.05, 0.09, 0.03), 0.1))


MASSES = {"feather": 0.0025, "light": 0.024, "lead": 0.05, "kilo": 1.0, "heavy": 2.3, "too-heavy": 3.2}


@pytest.fixture(scope="session")
def env(boxes: dict[str, Part]) -> Iterator[GraspDisplacementEnv]:
    """The task without a renderer."""
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
    made = gymnasium.make(
        "GraspDisplacement-v1", parts=[str(boxes["light"].folder)], obs_mode="none", render_backend="none"
    )
    unwrapped = made.unwrapped
    assert isinstance(unwrapped, GraspDisplacementEnv)
    yield unwrapped
    made.close()


@pytest.fixture(scope="session")
def attempt(env: GraspDisplacementEnv, boxes: dict[str, Part]) -> Attempt:
    """Places a box (x, y, turn; flat on the table) and grasps it."""

    def run(grasp: tuple[float, ...], *, part: str = "light", at=(0.5, 0.0), turn=0.0, height=0.015):
        pose = [*at, height, np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
        folder = str(boxes[part].folder)
        env.reset(seed=0, options=dict(parts=[folder], reconfigure=True, pose_base_obj=np.array([pose])))
        info = env.step(np.array([grasp], dtype=np.float32))[-1]
        return {name: value[0] for name, value in info.items() if torch.is_tensor(value) and value.ndim}

    return run


@pytest.fixture
def place(env: GraspDisplacementEnv, boxes: dict[str, Part]) -> Callable[[str], None]:
    """Places a box far from the hand, in a fresh scene."""

    def run(part: str) -> None:
        far = np.array([[0.5, -0.5, 0.015, 1, 0, 0, 0]])
        env.reset(seed=0, options=dict(parts=[str(boxes[part].folder)], reconfigure=True, pose_base_obj=far))

    return run
