"""Symmetries of a parallel gripper: the same prediction for grasps that are the same."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mskgrasp.core.grasp import centre_in_grasp_frame
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models, load_models
from mskgrasp.learning.network_config import Normalisation
from mskgrasp.learning.symmetry import mirror_and_turn
from tests import synthetic

VIEWS = {
    "half a turn": ((-1, -2), (-1, -1, 1, 1, -1, -1)),
    "mirror image": ((-2,), (1, -1, 1, -1, -1, 1)),
    "both": ((-1,), (-1, 1, 1, -1, 1, -1)),
}
"""Axes of a patch that are reversed, and signs of x, y, z, theta and the swing about x and y."""


def test_turned_and_mirrored_samples_are_what_the_turned_and_mirrored_scene_would_give():
    box = synthetic.Box(x=0.455, y=0.0, yaw=0.35, size=(0.06, 0.02, 0.03))
    grasp = np.array([0.46, 0.004, 0.02, 0.1])
    centre = centre_in_grasp_frame(box.T_base_obj.position, grasp)
    _, shift = synthetic.attempt(box, grasp)
    local = synthetic.Box(x=centre[0], y=centre[1], yaw=box.yaw - grasp[3], size=box.size)
    flat = np.array([0, 0, 0.02, 0])
    # The mirror image at the grasp's x axis, and the scene that a hand turned by half a turn sees.
    mirrored = dataclasses.replace(local, y=-local.y, yaw=-local.yaw)
    turned = dataclasses.replace(local, x=-local.x, y=-local.y)
    both = dataclasses.replace(mirrored, x=-mirrored.x, y=-mirrored.y)
    outcomes = [synthetic.attempt(b, flat)[1] for b in (local, mirrored, turned, both)]
    assert np.allclose(outcomes[0], shift)
    patch = torch.rand(1, 1, 6, 6)
    produced = set()
    for seed in range(40):
        generator = torch.Generator().manual_seed(seed)
        image, c, target = mirror_and_turn(
            patch, torch.from_numpy(centre)[None], torch.from_numpy(shift)[None], generator
        )
        signs = tuple(torch.sign(c[0, :2] / torch.from_numpy(centre[:2])).int().tolist())
        produced.add(signs)
        flips = {(1, 1): (), (1, -1): (-2,), (-1, -1): (-1, -2), (-1, 1): (-1,)}[signs]
        assert torch.equal(image, patch.flip(flips) if flips else patch)
        if signs == (1, -1):
            assert np.allclose(target[0], outcomes[1])
        if signs == (-1, -1):
            assert np.allclose(target[0], outcomes[2])
        if signs == (-1, 1):
            assert np.allclose(target[0], outcomes[3])
    assert len(produced) == 4


def test_a_swing_is_mirrored_as_the_rotation_that_it_is():
    rng = np.random.default_rng(1)
    mirror, half_turn = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, -1.0, 1.0])
    motion = np.concatenate([np.zeros((20, 3)), rng.uniform(-0.5, 0.5, (20, 3))], axis=1)
    for seed in range(5):
        _, centre, target = mirror_and_turn(
            torch.zeros(20, 1, 2, 2),
            torch.ones(20, 3),
            torch.from_numpy(motion),
            torch.Generator().manual_seed(seed),
        )
        for (_, _, _, turn, *swing), (_, _, _, other, *swung), signs in zip(
            motion, target.numpy(), centre.numpy(), strict=True
        ):
            turned = half_turn if signs[0] < 0 else np.eye(3)
            image = turned @ (mirror if signs[0] * signs[1] < 0 else np.eye(3))
            expected = image @ rotation(turn, swing) @ image.T
            np.testing.assert_allclose(rotation(other, swung), expected, atol=1e-12)


def rotation(turn: float, swing: np.ndarray) -> np.ndarray:
    return (Rotation.from_rotvec([*swing, 0.0]) * Rotation.from_euler("z", turn)).as_matrix()


@pytest.fixture(scope="module")
def models() -> Models:
    """The shipped weights, asked for all views."""
    models = load_models(PRETRAINED)
    return asked(models, symmetric_views=True)


def asked(models: Models, *, symmetric_views: bool) -> Models:
    network = models.meta.network.model_copy(update={"symmetric_views": symmetric_views})
    return dataclasses.replace(models, meta=models.meta.model_copy(update={"network": network}))


def scenes(models: Models, n: int = 5) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Patches, centres and heights of made-up boxes of different places and turns."""
    rows, columns = models.meta.network.patch_shape
    rng = np.random.default_rng(4)
    y, x = np.mgrid[rows - 1 : -1 : -1, :columns] * models.meta.network.pixel
    y, x = y - y.mean(), x - x.mean()
    centre = rng.uniform(-0.01, 0.01, (n, 3))
    yaw = rng.uniform(-1, 1, (n, 1, 1))
    dx, dy = x - centre[:, 0, None, None], y - centre[:, 1, None, None]
    along, across = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    patches = np.where((abs(along) < 0.03) & (abs(across) < 0.012), 0.025, 0.0)[:, None]
    return (
        torch.tensor(patches, dtype=torch.float32),
        torch.tensor(centre, dtype=torch.float32),
        torch.full((n,), 0.015),
    )


@pytest.mark.parametrize(("flipped", "signs"), VIEWS.values(), ids=VIEWS)
def test_equal_grasps_are_reported_the_same_displacement(models, flipped, signs):
    patches, centre, height = scenes(models)
    signs = torch.tensor(signs, dtype=torch.float32)
    mean, variance = models.grasp_displacement(patches, centre, height)
    other, other_variance = models.grasp_displacement(patches.flip(flipped), centre * signs[:3], height)
    assert torch.allclose(other, signs * mean, atol=1e-7)
    assert torch.allclose(other_variance, variance, rtol=1e-4)
    single = asked(models, symmetric_views=False)
    one, _ = single.grasp_displacement(patches, centre, height)
    two, _ = single.grasp_displacement(patches.flip(flipped), centre * signs[:3], height)
    assert not torch.allclose(two, signs * one, atol=1e-5)


@pytest.mark.parametrize(("flipped", "signs"), VIEWS.values(), ids=VIEWS)
def test_a_network_without_the_swing_has_four_views_too(models, flipped, signs):
    plain = models.meta.network.model_copy(update={"swing": False})
    targets = Normalisation(
        action_scale=models.meta.normalisation.action_scale, target_mean=(0.0,) * 4, target_std=(1.0,) * 4
    )
    fresh = build_models(ModelMeta(network=plain, normalisation=targets))
    patches, centre, height = scenes(models)
    signs = torch.tensor(signs[:4], dtype=torch.float32)
    mean, variance = fresh.grasp_displacement(patches, centre, height)
    other, other_variance = fresh.grasp_displacement(patches.flip(flipped), centre * signs[:3], height)
    assert mean.shape == variance.shape == (len(patches), 4)
    assert torch.allclose(other, signs * mean, atol=1e-6)
    assert torch.allclose(other_variance, variance, rtol=1e-4)


def test_views_that_disagree_make_the_displacement_less_certain(models):
    patches, centre, height = scenes(models)
    single = asked(models, symmetric_views=False)
    means, variances = [], []
    for flipped, signs in ((), (1, 1, 1, 1, 1, 1)), *VIEWS.values():
        signs = torch.tensor(signs, dtype=torch.float32)
        mean, variance = single.grasp_displacement(
            patches.flip(flipped) if flipped else patches, centre * signs[:3], height
        )
        means.append((signs * mean).numpy())
        variances.append(variance.numpy())
    scale = np.array(models.meta.calibration.variance_scale)
    mean, variance = models.grasp_displacement(patches, centre, height)
    np.testing.assert_allclose(mean, np.mean(means, 0), atol=1e-7)
    expected = np.mean(variances, 0) + scale * np.var(means, 0)
    np.testing.assert_allclose(variance, expected, rtol=1e-4)


def test_a_network_of_the_mean_alone_has_four_views_too(models):
    patches, centre, height = scenes(models)
    mean_only = models.meta.network.model_copy(update={"variance": False})
    fresh = build_models(models.meta.model_copy(update={"network": mean_only}))
    mean, variance = fresh.grasp_displacement(patches, centre, height)
    flipped, signs = VIEWS["half a turn"]
    turned, _ = fresh.grasp_displacement(patches.flip(flipped), centre * torch.tensor(signs[:3]), height)
    assert variance is None and torch.allclose(turned, torch.tensor(signs) * mean, atol=1e-6)


def test_no_grasps_have_no_displacement(models):
    patches, centre, height = scenes(models, 0)
    mean, variance = models.grasp_displacement(patches, centre, height)
    assert mean.shape == variance.shape == (0, 6)
