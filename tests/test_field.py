"""Grasps that share features see what they would see alone."""

import numpy as np
import pytest
import torch

from mskgrasp.field import FieldFeatures
from mskgrasp.grasp import centre_in_grasp_frame
from mskgrasp.images import view_part
from mskgrasp.models import ModelMeta, build_models
from mskgrasp.networks import NetworkConfig, Normalisation
from mskgrasp.planner import Planner, PlannerConfig
from mskgrasp.scoring import Scene, displacements, qualities
from tests import synthetic
from tests.synthetic import REGION, Box

CONFIG = NetworkConfig(
    architecture="field",
    patch_pixels=88,
    patch_side=0.176,
    channels=8,
    trunk_width=16,
    head_width=16,
    dropout=0.0,
)
NORMAL = Normalisation(action_scale=(0.05, 0.05, 0.02))
FRAME = synthetic.frame([Box(x=0.45, y=0.02, yaw=0.4, size=(0.07, 0.02, 0.03))])


@pytest.fixture(scope="module")
def features() -> FieldFeatures:
    torch.manual_seed(1)
    return FieldFeatures(CONFIG, NORMAL)


@pytest.fixture(scope="module")
def models():
    torch.manual_seed(2)
    return build_models(ModelMeta(network=CONFIG, normalisation=NORMAL))


@pytest.fixture(scope="module")
def scene(models) -> Scene:
    view = view_part(FRAME.depth, FRAME.intrinsics, FRAME.T_base_camera, table_z=0.0, region=REGION)
    return Scene.of(FRAME, view, 0.0, models.device)


def test_a_patch_cut_out_of_a_map_has_the_maps_features(features):
    image = torch.rand(1, 1, 120, 120, generator=torch.Generator().manual_seed(0))
    centre = torch.zeros(1, 3)
    where = torch.zeros(1, 1, 2)
    whole = features.at(features.maps(image), where, centre[None], (120, 120))
    alone = features(image[..., 16:104, 16:104], centre)
    torch.testing.assert_close(alone, whole, atol=1e-5, rtol=1e-4)


def test_a_patch_moved_by_whole_cells_keeps_the_grasps_features(features):
    image = torch.rand(1, 1, 120, 120, generator=torch.Generator().manual_seed(0))
    centre = torch.zeros(1, 3)
    middle = features(image[..., 16:104, 16:104], centre)
    # Four pixels down and eight to the right: the grasp is then above and left of the patch's middle.
    moved = features(image[..., 20:108, 24:112], centre, torch.tensor([-0.016, 0.008]))
    torch.testing.assert_close(moved, middle, atol=1e-5, rtol=1e-4)


def test_a_grasp_reads_the_map_where_it_is(features):
    image = torch.zeros(1, 1, 120, 120)
    image[..., 40:60, 70:80] = 1.0
    shifted = image.roll((-8, 16), dims=(-2, -1))  # 16 mm up, 32 mm to the right
    centre, size = torch.zeros(1, 1, 3), (120, 120)
    here = features.at(features.maps(image), torch.zeros(1, 1, 2), centre, size)
    there = features.at(features.maps(shifted), torch.tensor([[[0.032, 0.016]]]), centre, size)
    torch.testing.assert_close(there, here, atol=1e-5, rtol=1e-4)


def test_grasps_of_one_angle_have_the_quality_they_have_alone(models, scene):
    rng = np.random.default_rng(3)
    grasps = np.tile(np.append(scene.view.centre_base, 0.3), (12, 1))
    grasps[:, 2] += rng.uniform(-0.005, 0.005, 12)  # the height alone differs: all lie in the map's middle
    shared = qualities(models, scene, grasps, 32)
    alone = np.concatenate([qualities(models, scene, one[None], 32) for one in grasps])
    np.testing.assert_allclose(shared, alone, atol=2e-5)
    # Elsewhere the features are read between cells: near, and in the same order.
    grasps[:, :2] += rng.uniform(-0.02, 0.02, (12, 2))
    shared = qualities(models, scene, grasps, 32)
    alone = np.concatenate([qualities(models, scene, one[None], 32) for one in grasps])
    assert np.corrcoef(shared, alone)[0, 1] > 0.9


def test_unlike_numbers_of_grasps_an_angle_are_kept_apart(models, scene):
    angles = np.repeat([-0.7, 0.1, 0.9], (9, 4, 17))
    rng = np.random.default_rng(4)
    grasps = np.column_stack([scene.view.centre_base + rng.uniform(-0.01, 0.01, (30, 3)), angles])
    mixed = rng.permutation(30)
    found = qualities(models, scene, grasps[mixed], 32)
    np.testing.assert_allclose(found, qualities(models, scene, grasps, 32)[mixed], atol=1e-5)


def test_the_planner_plans_with_shared_features(models):
    config = PlannerConfig(n_candidates=320, n_angles=8)
    planner = Planner(models, config, table_z=0.0, region=REGION)
    plan = planner.plan(FRAME, np.random.default_rng(0))
    assert len(np.unique(plan.candidates[:, 3])) == 8
    again = planner.plan(FRAME, np.random.default_rng(0))
    assert np.array_equal(plan.grasp, again.grasp) and plan.quality == again.quality


def test_a_network_that_sees_the_part_is_told_the_angle(scene):
    torch.manual_seed(5)
    network = NetworkConfig(
        image="object", patch_pixels=32, channels=4, trunk_width=8, action_width=8, head_width=8, dropout=0.0
    )
    models = build_models(ModelMeta(network=network, normalisation=NORMAL))
    grasps = np.tile(np.append(scene.view.centre_base + [0.01, 0.0, 0.0], 0.0), (3, 1))
    grasps[:, 3] = [0.0, 0.5, 0.5]
    mean, variance = displacements(models, scene, grasps, 2)
    assert np.allclose(mean[1], mean[2]) and not np.allclose(mean[0], mean[1])
    assert mean.shape == variance.shape == (3, 4) and (variance > 0).all()
    # What the network says along the picture's axes, worked out by hand for the second grasp.
    centre = torch.tensor([[-0.01, 0.0, 0.0]])
    patch = scene.crop(np.append(scene.view.centre_base, 0.0)[None], 32, network.patch_side)
    inputs = models.gdn.features.prepare(patch)
    action = torch.cat([centre, torch.tensor([[0.5]])], dim=-1)
    with torch.inference_mode():
        x, y = models.gdn.outputs(models.gdn.features(inputs, action))[0][0, :2].tolist()
    cos, sin = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(mean[1, :2], [cos * x + sin * y, cos * y - sin * x], atol=1e-6)
    assert np.allclose(centre_in_grasp_frame(scene.view.centre_base, grasps[0]), centre.numpy(), atol=1e-9)
