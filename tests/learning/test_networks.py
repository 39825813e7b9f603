import json

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from mskgrasp.core.errors import BadModel
from mskgrasp.learning.grasp_models import PRETRAINED, ModelMeta, build_models, load_models, save_model
from mskgrasp.learning.hand_features import HandFeatures
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation, PatchNetworkConfig
from mskgrasp.learning.networks import (
    GraspDisplacementNetwork,
    GraspQualityNetwork,
    displacement_loss,
    standardise,
    with_noise,
)
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.scoring import Scene
from tests import synthetic

SMALL = PatchNetworkConfig(
    patch_pixels=32, channels=4, trunk_width=16, action_width=8, head_width=8, dropout=0.5
)
NORMAL = Normalisation(
    action_scale=(0.05, 0.02, 0.01),
    target_mean=(0.0, 0.0, 0.001, 0.0),
    target_std=(0.002, 0.005, 0.001, 0.2),
    base_rate=0.2,
)


def small_models(seed=0, **changes):
    torch.manual_seed(seed)
    return build_models(ModelMeta(network=SMALL.model_copy(update=changes), normalisation=NORMAL))


@pytest.fixture
def folder(tmp_path):
    save_model(tmp_path, small_models())
    return tmp_path


def count(network):
    return sum(parameter.numel() for parameter in network.parameters())


def test_the_papers_networks_have_the_sizes_worked_out_by_hand():
    # Valid padding: 64 -> 60 -> 56 -> pool 28 -> 24 -> 20 -> pool 10, and 10 * 10 * 32 = 3200.
    convolutions = (25 * 1 * 32 + 32) + 3 * (25 * 32 * 32 + 32)
    trunk, action = 3200 * 1024 + 1024, 3 * 64 + 64
    hidden = (1024 + 64) * 512 + 512
    shared = convolutions + trunk + action
    assert (
        count(GraspQualityNetwork(PatchNetworkConfig(), NORMAL)) == shared + hidden + 512 * 2 + 2 == 3914402
    )
    gdn = GraspDisplacementNetwork(PatchNetworkConfig(), NORMAL)
    assert count(gdn) == shared + 2 * (hidden + 512 * 4 + 4) == 4475048
    mean_only = GraspDisplacementNetwork(PatchNetworkConfig(variance=False), NORMAL)
    assert count(mean_only) == shared + hidden + 512 * 4 + 4


def test_outputs_have_their_shapes_and_variances_are_positive():
    models = small_models()
    patches, centres, height = torch.rand(5, 1, 32, 32), torch.rand(5, 3) * 0.02, torch.rand(5) * 0.03
    quality = models.quality(patches, centres, height)
    mean, variance = models.grasp_displacement(patches, centres, height)
    assert quality.shape == (5,) and mean.shape == variance.shape == (5, 4)
    assert bool(((quality > 0) & (quality < 1)).all()) and bool((variance > 0).all())
    assert small_models(variance=False).grasp_displacement(patches, centres, height)[1] is None


def test_an_undecided_network_says_the_base_rate():
    models = small_models()
    assert float(models.gqn.quality(torch.zeros(1, 2))) == pytest.approx(0.2)


def test_an_untrained_network_predicts_in_the_units_of_its_targets():
    models = small_models()
    with torch.no_grad():
        models.gdn.mean_head[-1].weight.zero_()
        models.gdn.mean_head[-1].bias.zero_()
        models.gdn.variance_head[-1].weight.zero_()
        models.gdn.variance_head[-1].bias.zero_()
    mean, variance = models.grasp_displacement(torch.rand(2, 1, 32, 32), torch.zeros(2, 3), torch.zeros(2))
    assert torch.allclose(mean, torch.tensor(NORMAL.target_mean))
    assert torch.allclose(variance, torch.tensor(NORMAL.target_std).square())


def test_no_displacement_is_claimed_to_be_known_below_the_floor():
    models = small_models(least_std=(0.0005, 0.01))
    with torch.no_grad():
        models.gdn.variance_head[-1].bias.fill_(-100.0)
    _, variance = models.grasp_displacement(torch.rand(2, 1, 32, 32), torch.zeros(2, 3), torch.zeros(2))
    floor = torch.tensor([0.0005, 0.0005, 0.0005, 0.01])
    assert bool((variance.sqrt() >= floor * 0.999).all()) and torch.allclose(
        variance.sqrt(), floor, rtol=0.01
    )


def test_preprocessing_standardises_and_ignores_the_height():
    patches = torch.rand(3, 1, 32, 32) * 0.05
    done = standardise(patches)
    assert torch.allclose(done.mean(dim=(1, 2, 3)), torch.zeros(3), atol=1e-4)
    assert torch.allclose(done.std(dim=(1, 2, 3)), torch.ones(3), atol=0.02)
    assert torch.allclose(standardise(patches + 0.3), done, atol=1e-3)
    flat = standardise(torch.full((1, 1, 32, 32), 0.01))
    assert float(flat.abs().max()) < 1e-4


def test_our_network_sees_what_the_hand_would_meet():
    config = HandNetworkConfig(patch_pixels=16, patch_columns=8, layers=(4, 8))
    features = HandFeatures(config, NORMAL, config.layers, config.quality_shape)
    # A step from the table to 30 mm, a finger tip at 10.5 mm (TCP at 20 mm), the palm far above.
    patch = torch.zeros(1, 1, 16, 8)
    patch[..., :8, :] = 0.03
    tips, beside, palm, table = features.prepare(patch, torch.tensor([0.02]))[0]
    assert torch.equal(tips[:8], torch.ones(8, 8)) and torch.equal(tips[8:], -torch.ones(8, 8))
    assert torch.allclose(beside[:8], torch.tensor(1 / 3)) and torch.allclose(
        beside[8:], torch.tensor(-2 / 3)
    )
    assert torch.equal(palm, -torch.ones(16, 8)) and torch.allclose(table[:8], torch.tensor(0.6))
    # 56 mm below the top of a part the palm meets it.
    assert float(features.prepare(patch + 0.05, torch.tensor([0.02]))[0, 2, 0, 0]) == 1.0
    models = build_models(ModelMeta(network=config, normalisation=NORMAL))
    inputs = torch.rand(3, 1, 16, 8), torch.zeros(3, 3), torch.full((3,), 0.02)
    assert models.quality(*inputs).shape == (3,) and models.grasp_displacement(*inputs)[0].shape == (3, 4)


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


def test_noise_has_its_deviation_and_comes_from_the_generator_alone():
    patches = torch.zeros(4, 1, 64, 64)
    first, again = (with_noise(patches, 0.003, torch.Generator().manual_seed(1)) for _ in "ab")
    assert torch.equal(first, again)
    assert float(first.std()) == pytest.approx(0.003, rel=0.02)
    # Standardised, it is divided by its own deviation and the epsilon of 0.1 mm.
    assert float(standardise(first).std()) == pytest.approx(0.003 / 0.0031, rel=0.02)


def test_the_gdn_starts_from_the_gqns_convolutions_only():
    models = small_models()
    models.gdn.start_from(models.gqn)
    for one, other in zip(
        models.gqn.features.convolutions.parameters(),
        models.gdn.features.convolutions.parameters(),
        strict=True,
    ):
        assert torch.equal(one, other) and one is not other
    assert not torch.equal(models.gqn.features.image[1].weight, models.gdn.features.image[1].weight)


def test_the_loss_is_twice_the_gaussian_likelihood_up_to_a_constant():
    torch.manual_seed(0)
    std = torch.tensor(NORMAL.target_std)
    mean, target = torch.randn(2, 6, 4) * std
    variance = (torch.rand(6, 4) + 0.5) * std.square()
    likelihood = torch.distributions.Normal(mean, variance.sqrt()).log_prob(target).sum(dim=-1).mean()
    constant = 4 * np.log(2 * np.pi) + 2 * float(std.log().sum())
    loss = displacement_loss(mean, variance, target, std)
    assert float(loss) == pytest.approx(-2 * float(likelihood) - constant, rel=1e-5)


def test_the_loss_wraps_the_angle_and_is_four_for_the_trivial_prediction():
    std = torch.ones(4)
    mean, target = torch.zeros(1, 4), torch.zeros(1, 4)
    mean[0, 3], target[0, 3] = 3.1, -3.1
    assert float(displacement_loss(mean, None, target, std)) == pytest.approx(
        (2 * np.pi - 6.2) ** 2, rel=1e-4
    )
    many = torch.randn(50000, 4, generator=torch.Generator().manual_seed(0)) * 0.3
    trivial = displacement_loss(torch.zeros_like(many), torch.full_like(many, 0.09), many, std * 0.3)
    assert float(trivial) == pytest.approx(4.0, rel=0.02)


def test_the_loss_is_least_at_the_true_mean_and_variance():
    target = torch.randn(20000, 4, generator=torch.Generator().manual_seed(0)) * 0.5 + 0.1
    std = torch.ones(4)

    def loss(mean, variance):
        return float(
            displacement_loss(torch.full_like(target, mean), torch.full_like(target, variance), target, std)
        )

    best = loss(0.1, 0.25)
    assert all(best < loss(*other) for other in ((0.2, 0.25), (0.0, 0.25), (0.1, 0.35), (0.1, 0.18)))


def test_a_saved_model_predicts_the_same_when_loaded(folder):
    models, again = small_models(), load_models(folder)
    inputs = torch.rand(3, 1, 32, 32), torch.rand(3, 3) * 0.01, torch.full((3,), 0.02)
    assert torch.equal(models.quality(*inputs), again.quality(*inputs))
    for one, other in zip(models.grasp_displacement(*inputs), again.grasp_displacement(*inputs), strict=True):
        assert torch.equal(one, other)
    assert again.meta == models.meta
    assert sorted(path.name for path in folder.iterdir()) == ["model.json", "model.safetensors"]


def complaint(folder):
    with pytest.raises(BadModel) as caught:
        load_models(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def change_weights(folder, change):
    weights = load_file(folder / "model.safetensors")
    change(weights)
    save_file(weights, folder / "model.safetensors")


def change_description(folder, change):
    values = json.loads((folder / "model.json").read_text())
    change(values)
    (folder / "model.json").write_text(json.dumps(values))


def test_missing_files_are_told(tmp_path, folder):
    assert "no model.json" in complaint(tmp_path / "nowhere")
    (folder / "model.safetensors").unlink()
    assert "no model.safetensors" in complaint(folder)


def test_damaged_files_are_told(folder):
    data = (folder / "model.safetensors").read_bytes()
    (folder / "model.safetensors").write_bytes(data[: len(data) // 2])
    assert "damaged" in complaint(folder)
    (folder / "model.json").write_text("{")
    assert "damaged" in complaint(folder)


def test_weights_that_are_not_finite_are_told_and_never_saved(folder):
    change_weights(folder, lambda weights: weights["gdn.mean_head.0.bias"].fill_(torch.nan))
    assert "gdn.mean_head.0.bias is not finite" in complaint(folder)
    models = small_models()
    with torch.no_grad():
        next(models.gqn.parameters()).fill_(torch.inf)
    with pytest.raises(BadModel, match="not finite"):
        save_model(folder / "new", models)
    assert not (folder / "new").exists()


def test_a_description_of_another_patch_or_network_is_told(folder):
    change_description(folder, lambda values: values["network"].update(patch_pixels=64))
    assert "patches of 64 pixels" in complaint(folder)
    change_description(folder, lambda values: values["network"].update(patch_pixels=32, variance=False))
    assert "unknown weight" in complaint(folder)
    change_description(folder, lambda values: values["network"].update(variance=True, colour=1))
    assert "colour" in complaint(folder)


def test_other_schema_versions_and_missing_weights_are_told(folder):
    change_weights(folder, lambda weights: weights.pop("gqn.head.0.weight"))
    assert "lacks weight gqn.head.0.weight" in complaint(folder)
    change_description(folder, lambda values: values.update(schema_version=7))
    assert "schema version 7" in complaint(folder)


def test_patches_of_another_size_are_refused():
    with pytest.raises(BadModel, match=r"takes \(n, 1, 32, 32\)"):
        small_models().quality(torch.zeros(1, 1, 64, 64), torch.zeros(1, 3), torch.zeros(1))


def test_the_shipped_model_is_loaded_as_its_own_architecture():
    stored = json.loads((PRETRAINED / "model.json").read_text())["network"]
    network = load_models(PRETRAINED).meta.network
    assert isinstance(network, HandNetworkConfig)
    assert {name: list(v) if isinstance(v, tuple) else v for name, v in network.model_dump().items()} == {
        name: value for name, value in stored.items() if name not in ("channels", "image")
    }


def test_descriptions_that_list_both_architectures_are_read(folder):
    both = {
        "patch_columns": None, "quality_stride": 1, "quality_columns": None,
        "layers": [16, 32], "displacement_layers": [16, 32, 32],
    }  # fmt: skip
    change_description(folder, lambda values: values["network"].update(both))
    assert load_models(folder).meta.network == SMALL
    change_description(folder, lambda values: values["network"].pop("architecture"))
    assert load_models(folder).meta.network == SMALL
