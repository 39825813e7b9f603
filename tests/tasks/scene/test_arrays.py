from __future__ import annotations

import numpy as np
import pytest
import torch

import tasks.robot.contacts
import tasks.robot.motion
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.panda_kinematics import top_down
from tasks.scene.arrays import Arrays

TENSORS = Arrays(torch.device("cpu"))
ON_THE_FINGER = dict(grasp=(0.5, 0.0, 0.012, 0.0), at=(0.5, 0.045), part="kilo")
GRASPS = {
    "none": dict(grasp=(0.5, 0.001, 0.02, 0.1)),
    "missed": dict(grasp=(0.5, 0.0, 0.02, 0.0), at=(0.5, 0.15)),
    "slipped": dict(grasp=(0.5, 0.0, 0.02, 0.0), part="too-heavy"),
    "collided": ON_THE_FINGER,
}


@pytest.mark.parametrize("reason", list(GRASPS))
def test_an_attempt_with_tensors_is_that_with_arrays(env, attempt, monkeypatch, reason):
    """A GPU has tensors, and PhysX needs one of its own: so what both share runs with tensors here, too."""
    with monkeypatch.context() as patch:
        for module in (tasks.robot.motion, tasks.robot.contacts):
            patch.setattr(module, "arrays_for", lambda _: TENSORS)
        tensors = attempt(**GRASPS[reason])
        assert env.motion.arrays is TENSORS
    arrays = attempt(**GRASPS[reason])
    assert env.motion.arrays.device is None
    assert FAILURES[int(arrays["failure"])] == reason
    assert arrays.keys() == tensors.keys()
    for name, value in arrays.items():
        assert value.dtype == tensors[name].dtype, name
        assert value.numpy() == pytest.approx(tensors[name].numpy(), abs=1e-6, nan_ok=True), name


def test_joints_are_the_same_for_both_kinds():
    grasps = np.random.default_rng(0).uniform([0.3, -0.2, 0.01, -1.5], [0.9, 0.2, 0.3, 1.5], (200, 4))
    joints, reachable = top_down(grasps)
    as_tensors = top_down(torch.as_tensor(grasps))
    assert 20 < reachable.sum() < 180
    assert np.array_equal(reachable, as_tensors[1].numpy())
    assert joints[reachable] == pytest.approx(as_tensors[0].numpy()[reachable], abs=1e-12)


@pytest.mark.parametrize("arrays", [Arrays(None), TENSORS], ids=["numpy", "torch"])
def test_arrays_are_of_their_kind(arrays):
    kind = np.ndarray if arrays.device is None else torch.Tensor
    whole, flags = arrays.full(3, 0.5), arrays.full(3, True)
    assert isinstance(whole, kind)
    assert isinstance(flags, kind)
    assert isinstance(arrays.of(np.zeros(2)), kind)
    assert isinstance(arrays.of(torch.zeros(2)), kind)
    assert (whole.dtype, flags.dtype) == (arrays.xp.float32, arrays.xp.bool)
    assert arrays.numpy(whole).dtype == np.float64
