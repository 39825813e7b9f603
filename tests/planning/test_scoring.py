from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from mskgrasp.learning.grasp_models import ModelMeta, build_models, load_models
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation, PatchNetworkConfig
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning import scoring
from mskgrasp.planning.scoring import Scene, displacements, qualities
from tests import synthetic
from tests.planning.hand_made import FRAME
from tests.synthetic import REGION


def test_the_quality_network_sees_every_second_pixel_of_the_middle_of_the_same_place():
    network = HandNetworkConfig(patch_pixels=33, patch_side=0.066, quality_stride=2, quality_columns=9)
    assert network.quality_shape == (17, 9)
    box = synthetic.Box(x=0.45, y=0.02, yaw=0.4, size=(0.07, 0.02, 0.03))
    frame = synthetic.frame([box])
    view = view_part(frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=synthetic.REGION)
    scene = Scene.of(frame, view, 0.0, torch.device("cpu"))
    grasps = np.array([[0.46, 0.01, 0.02, 0.3]])
    whole, coarse = scene.crop(grasps, network), scene.crop_for_quality(grasps, network)
    assert whole.shape == (1, 1, 33, 33) and coarse.shape == (1, 1, 17, 9)
    assert torch.allclose(whole[..., ::2, 8:25:2], coarse, atol=1e-6)


@pytest.mark.parametrize("nothing", [np.inf, -np.inf])
def test_infinite_depth_is_as_unknown_as_nan(nothing):
    network = HandNetworkConfig(patch_pixels=33, patch_side=0.066)
    frame = synthetic.frame([synthetic.Box(x=0.45, y=0.02, yaw=0.4, size=(0.07, 0.02, 0.03))])
    hole = np.zeros(frame.depth.shape, bool)
    hole[70:80, 60:100] = True
    scenes = []
    for value in (nothing, np.nan):
        holed = replace(frame, depth=np.where(hole, np.float32(value), frame.depth))
        view = view_part(
            holed.depth, holed.intrinsics, holed.T_base_camera, table_z=0.0, region=synthetic.REGION
        )
        scenes.append(Scene.of(holed, view, 0.0, torch.device("cpu")))
    grasps = np.array([[0.46, 0.01, 0.02, 0.3]])
    infinite, unknown = (scene.crop(grasps, network) for scene in scenes)
    assert torch.isfinite(infinite).all() and torch.equal(infinite, unknown)


def test_a_network_that_sees_the_part_is_reported_the_angle():
    torch.manual_seed(5)
    network = PatchNetworkConfig(
        image="object", patch_pixels=32, channels=4, trunk_width=8, action_width=8, head_width=8, dropout=0.0
    )
    scale = Normalisation(action_scale=(0.05, 0.05, 0.02))
    models = build_models(ModelMeta(network=network, normalisation=scale))
    view = view_part(FRAME.depth, FRAME.intrinsics, FRAME.T_base_camera, table_z=0.0, region=REGION)
    scene = Scene.of(FRAME, view, 0.0, models.device)
    grasps = np.tile(np.append(view.centre_base + [0.01, 0.0, 0.0], 0.0), (3, 1))
    grasps[:, 3] = [0.0, 0.5, 0.5]
    mean, variance = displacements(models, scene, grasps, 2)
    assert np.allclose(mean[1], mean[2]) and not np.allclose(mean[0], mean[1])
    assert mean.shape == variance.shape == (3, 4) and (variance > 0).all()
    # What the network says along the picture's axes, worked out by hand for the second grasp.
    action = torch.tensor([[-0.01, 0.0, 0.0, 0.5]])
    patch = scene.crop(np.append(view.centre_base, 0.0)[None], network)
    height = torch.tensor([view.centre_base[2]], dtype=torch.float32)
    with torch.inference_mode():
        prepared = models.gdn.features.prepare(patch, height)
        x, y = models.gdn.outputs(models.gdn.features(prepared, action, height))[0][0, :2].tolist()
    cos, sin = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(mean[1, :2], [cos * x + sin * y, cos * y - sin * x], atol=1e-6)


@pytest.mark.parametrize(
    ("predict", "n", "sizes"),
    [
        (qualities, 1600, [400] * 4),
        (qualities, 3601, [721] * 4 + [717]),
        (displacements, 96, [24] * 4),  # seen in four views each
        (displacements, 16, [8, 8]),
        (displacements, 1, [1]),
        (displacements, 0, []),
    ],
)
def test_grasps_are_shared_out_evenly_among_two_batches_or_more(predict, n, sizes, monkeypatch):
    seen = []

    def noted(function, batches, device):
        batches = list(batches)
        seen.extend(len(batch.height) for batch in batches)
        return [function(batch) for batch in batches]

    monkeypatch.setattr(scoring, "map_batches", noted)
    view = view_part(FRAME.depth, FRAME.intrinsics, FRAME.T_base_camera, table_z=0.0, region=REGION)
    models = load_models()
    scene = Scene.of(FRAME, view, 0.0, models.device)
    predict(models, scene, np.tile(np.append(view.centre_base, 0.0), (n, 1)), 800)
    assert seen == sizes
