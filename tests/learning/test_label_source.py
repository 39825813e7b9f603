"""Origin of a model's labels: read from the shards, stored with the model, compared with the hand."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from mskgrasp.core.errors import BadDataset, BadModel
from mskgrasp.core.grasp import HAND_GEOMETRY
from mskgrasp.core.settings import Physics
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.learning.grasp_models import DESCRIPTION, load_models
from mskgrasp.learning.label_source import LabelSource, distinct, other_conditions, source_of, source_text
from mskgrasp.learning.model_card import model_card


def test_the_source_of_collected_labels_is_what_their_shards_say(collected: Path):
    infos = [read_shard(path)[1] for path in list_shards(collected)]
    (source,) = distinct(source_of(info) for info in infos)
    assert source.physics == infos[0].physics and source.hand == HAND_GEOMETRY and source.seed == 5
    assert source.simulation == infos[0].versions["simulation"] and source.noise == {}
    assert source.camera_height == pytest.approx(infos[0].T_base_camera.position[2])


def test_a_shard_whose_settings_are_no_numbers_is_refused(collected: Path):
    _, info = read_shard(list_shards(collected)[0])
    with pytest.raises(BadDataset, match="rate_hz must be a number") as caught:
        source_of(dataclasses.replace(info, physics=info.physics | {"rate_hz": "fast"}))
    assert "\n" not in str(caught.value)


def described(tmp_path: Path, collected: Path, **hand: float) -> Path:
    """A copy of the shipped model whose labels are said to be of the collected shards, with another hand."""
    source = source_of(read_shard(list_shards(collected)[0])[1])
    values = json.loads((PRETRAINED / DESCRIPTION).read_text())
    values["labels"] = [source.model_dump() | {"hand": HAND_GEOMETRY | hand}]
    (tmp_path / DESCRIPTION).write_text(json.dumps(values))
    (tmp_path / "model.safetensors").symlink_to(PRETRAINED / "model.safetensors")
    return tmp_path


def test_a_model_tells_its_source_and_its_card_shows_what_differs(tmp_path: Path, collected: Path):
    models = load_models(described(tmp_path, collected))
    (source,) = models.meta.labels
    assert source.hand == HAND_GEOMETRY
    other = source.model_copy(
        update={"physics": source.physics | {"rate_hz": 500}, "noise": {"finger_force": [30.0, 70.0]}}
    )
    card = model_card(models.meta.model_copy(update={"labels": (other,)}))
    assert "physics other than the defaults: rate_hz 500\n" in card
    assert "errors of the cell: finger_force 30.0 x 70.0" not in card
    assert "errors of the cell: finger_force 30.0 to 70.0" in card


def test_a_model_of_another_hand_is_refused(tmp_path: Path, collected: Path):
    folder = described(tmp_path, collected, max_opening=0.1)
    with pytest.raises(BadModel, match=r"another hand \(max_opening 100\.0 mm, this one's 80\.0 mm\)"):
        load_models(folder)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (dict(noise={"friction_pad_part": [0.3]}), "friction_pad_part must be a number, or the bounds"),
        (dict(physics={"friction_pad_part": "high"}), "friction_pad_part must be a number, or the bounds"),
    ],
)
def test_a_description_whose_settings_are_no_numbers_is_refused(changes, words):
    values = dict(simulation="4", fidelity="cpu", physics={}, noise={}, hand={}, camera_height=0.8, seed=0)
    with pytest.raises(ValueError, match=words):
        LabelSource.model_validate(values | changes)


def test_conditions_other_than_those_of_the_labels_are_named():
    source = LabelSource(
        simulation="4", fidelity="cpu", physics=Physics().model_dump(), hand={}, camera_height=0.8, seed=0,
        noise={"friction_pad_part": (0.3, 0.8), "arm_position_std": 0.001},
    )  # fmt: skip
    assert other_conditions(source, Physics(friction_pad_part=0.7), 0.82) == []
    assert other_conditions(source, None, None) == []
    assert other_conditions(source, None, 0.75) == other_conditions(source, None, 0.85) == []
    smooth = Physics(friction_pad_part=0.2, friction_table_part=0.6)
    assert other_conditions(source, smooth, 1.1) == [
        "camera 1.10 m over the table, not 0.80",
        "friction_pad_part 0.2, not 0.3 to 0.8",
        "friction_table_part 0.6, not 0.4",
    ]
    coarse = Physics(rate_hz=250, position_iterations=4, persistent_manifold=True, skip_air=False)
    assert other_conditions(source, coarse, None) == [
        "rate_hz 250, not 1000",
        "coarse_rate_hz 250, not 500",
        "position_iterations 4, not 50",
        "persistent_manifold 1, not 0",
    ]
    assert source_text(source) == (
        "simulation version 4, fidelity cpu, camera 0.80 m over the table, errors of the cell: "
        "arm_position_std 0.001; friction_pad_part 0.3 to 0.8"
    )
    chosen = source.model_copy(update={"planner": "0123"})
    assert source_text(chosen) == f"{source_text(source)}, grasps chosen by a planner"
