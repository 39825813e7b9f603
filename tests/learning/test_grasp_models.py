import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from mskgrasp.core.errors import BadModel, MissingModel
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models, save_model
from mskgrasp.learning.network_config import HandNetworkConfig
from tests.learning.small import small_models


@pytest.fixture
def folder(tmp_path):
    save_model(tmp_path, small_models())
    return tmp_path


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


def test_missing_files_are_reported(tmp_path, folder):
    assert "no model.json" in complaint(tmp_path / "nowhere")
    (folder / "model.safetensors").unlink()
    assert "no model.safetensors" in complaint(folder)
    with pytest.raises(
        MissingModel,
        match=r"no model.safetensors in .*train a model: python -m mskgrasp.train --data DATASET",
    ):
        load_models(folder)


def test_damaged_files_are_reported(folder):
    data = (folder / "model.safetensors").read_bytes()
    (folder / "model.safetensors").write_bytes(data[: len(data) // 2])
    assert "damaged" in complaint(folder)
    (folder / "model.json").write_text("{")
    assert "damaged" in complaint(folder)


def test_a_description_with_a_metric_that_is_not_known_is_read(folder):
    """NaN, where no grasp of the validation parts succeeded."""
    change_description(folder, lambda values: values["metrics"].update(auroc=float("nan")))
    assert np.isnan(load_models(folder).meta.metrics["auroc"])


def test_weights_that_are_not_finite_are_reported_and_never_saved(folder):
    change_weights(folder, lambda weights: weights["gdn.mean_head.0.bias"].fill_(torch.nan))
    assert "gdn.mean_head.0.bias is not finite" in complaint(folder)
    models = small_models()
    with torch.no_grad():
        next(models.gqn.parameters()).fill_(torch.inf)
    with pytest.raises(BadModel, match="not finite"):
        save_model(folder / "new", models)
    assert not (folder / "new").exists()


@pytest.mark.parametrize("views", [False, True])
@pytest.mark.parametrize("variance", [False, True])
def test_a_prediction_that_is_not_finite_is_refused(views, variance):
    models = small_models(symmetric_views=views, variance=variance)
    with torch.no_grad():
        models.gdn.mean_head[0].bias.fill_(torch.inf)
    with pytest.raises(BadModel):
        models.grasp_displacement(torch.rand(3, 1, 32, 32), torch.rand(3, 3) * 0.01, torch.full((3,), 0.02))


def test_a_description_of_another_patch_or_network_is_reported(folder):
    change_description(folder, lambda values: values["network"].update(patch_pixels=64))
    assert "patches of 64 pixels" in complaint(folder)
    change_description(folder, lambda values: values["network"].update(patch_pixels=32, variance=False))
    assert "unknown weight" in complaint(folder)
    change_description(folder, lambda values: values["network"].update(variance=True, colour=1))
    assert "colour" in complaint(folder)


@pytest.mark.parametrize("parts", [5, "hex_nut_m30", [1, 2]])
def test_a_description_whose_parts_are_no_names_is_reported(folder, parts):
    change_description(folder, lambda values: values.update(training={"training_parts": parts}))
    assert "training.training_parts must be a list of names" in complaint(folder)


def test_other_schema_versions_and_missing_weights_are_reported(folder):
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
    read = {name: list(v) if isinstance(v, tuple) else v for name, v in network.model_dump().items()}
    assert read == stored | {"blocks": []}  # a field that is younger than the model


def test_a_description_without_an_architecture_or_with_anothers_field_is_refused(folder):
    change_description(folder, lambda values: values["network"].update(layers=[16, 32]))
    with pytest.raises(BadModel, match="'network.patch.layers': extra inputs are not permitted"):
        load_models(folder)
    change_description(folder, lambda values: values["network"].pop("architecture"))
    with pytest.raises(BadModel, match="'network': .*'architecture'"):
        load_models(folder)


def test_reading_a_model_does_not_load_what_torch_computes_shapes_with():
    """It takes a second: any arithmetic on tensors without numbers loads it."""
    program = (
        "import sys; from mskgrasp.learning.grasp_models import load_models; load_models(); "
        "print('sympy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
