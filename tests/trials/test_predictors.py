"""Models of the grasp displacement: what they know, and what they say of a point of the part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, NoGraspFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.trials.predictors import (
    LowessPredictor,
    NetworkPredictor,
    PartObservation,
    fit_lowess,
    predict_one,
)
from tests import synthetic
from tests.planning.hand_made import BOX, FRAME, hand_made_models


def observation(part: str = "box_0", pose: Pose | None = None) -> PartObservation:
    return PartObservation(part=part, frame=FRAME, view=synthetic.view(FRAME.depth), pose_base_obj=pose)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic.write_dataset(tmp_path_factory.mktemp("boxes"), n_parts=2, n_attempts=60, seed=3)


@dataclass(frozen=True)
class Constant:
    """Predicts the same for every grasp."""

    mean: tuple[float, float, float, float]
    variance: tuple[float, float, float, float]
    has_variance: bool = True

    def knows(self, part: str) -> bool:
        return False

    def predict(self, observation: PartObservation, grasps: Grasp) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self.mean, (len(grasps), 1)), np.tile(self.variance, (len(grasps), 1))


def test_a_quarter_turn_of_the_hand_moves_a_point_as_worked_out_by_hand():
    """The hand turns by -90 degrees in the part's frame: seen from it the part turns by 90 about the TCP."""
    grasp = Grasp.from_vector(np.array([0.5, 0.1, 0.02, np.pi / 2]))  # the grasp frame's x is the base's y
    point = np.array([0.5, 0.11, 0.02])  # 10 mm along it
    found = predict_one(Constant((0, 0, 0, -np.pi / 2), (1e-6, 4e-6, 0, 0)), observation(), grasp, point)
    np.testing.assert_allclose(found.mean, [-0.01, 0.01, 0.0, np.pi / 2], atol=1e-12)
    # The hand's shifts along x and y of the grasp frame are turned along with the part.
    np.testing.assert_allclose(found.std, [0.002, 0.001, 0.0, 0.0], atol=1e-12)


def test_an_uncertain_turn_spreads_a_point_by_its_distance():
    grasp, point = Grasp.from_vector(np.array([0.5, 0.0, 0.02, 0.0])), np.array([0.52, 0.0, 0.02])
    found = predict_one(Constant((0, 0, 0, 0), (0, 0, 0, 0.1**2)), observation(), grasp, point)
    np.testing.assert_allclose(found.std, [0.0, 0.1 * 0.02, 0.0, 0.1], atol=1e-12)
    at_the_tcp = predict_one(Constant((0, 0, 0, 0), (0, 0, 0, 0.1**2)), observation(), grasp, grasp.position)
    np.testing.assert_allclose(at_the_tcp.std, [0.0, 0.0, 0.0, 0.1], atol=1e-12)


@pytest.mark.parametrize("variance", [True, False])
def test_a_network_knows_its_training_parts_and_says_whether_it_predicts_variances(variance: bool):
    models = hand_made_models(variance=variance)
    models.meta.training["training_parts"] = ["nut"]
    network = NetworkPredictor(models, 640)
    assert network.knows("nut") and not network.knows("bolt") and network.has_variance == variance
    mean, spread = network.predict(observation(), Grasp.from_vector(np.array([[0.45, 0.02, 0.015, 0.4]] * 3)))
    np.testing.assert_allclose(mean, np.tile([0.001, 0.002, 0.0, 0.1], (3, 1)), atol=1e-6)
    assert spread.shape == (3, 4) and bool(np.isfinite(spread).all()) == variance


def hashes(data: Path, name: str) -> dict[str, str]:
    """Content hash of a part as its shards state it, by its name."""
    found = [read_shard(path)[1] for path in list_shards(data)]
    return {info.part: info.part_hash for info in found if info.part == name}


def test_lowess_is_fitted_to_the_successes_of_the_parts_that_are_asked_for(data: Path):
    fits, digests = fit_lowess(data, hashes(data, "box_1") | {"nowhere": ""})
    assert set(fits) == set(digests) == {"box_1"}
    lowess = LowessPredictor(fits)
    assert lowess.knows("box_1") and not lowess.knows("box_0") and lowess.has_variance
    assert fit_lowess(data, hashes(data, "box_1"))[1] == digests  # the same grasps, the same digest
    assert fit_lowess(data, hashes(data, "box_0"))[1]["box_0"] != digests["box_1"]


def test_grasps_of_another_version_of_a_part_are_refused(data: Path):
    with pytest.raises(BadDataset, match="part 'box_1' has changed since it was grasped; collect"):
        fit_lowess(data, {"box_1": "0" * 64})


def test_lowess_predicts_a_recorded_grasp_of_a_box_that_closing_centres(data: Path):
    """Of a box the jaw undoes the offset of the centre along y; neighbours of a recorded grasp say so."""
    (path,) = [path for path in list_shards(data) if path.stem.startswith("box_0")]
    attempts, _ = read_shard(path)
    held = np.flatnonzero(attempts.success)
    lowess = LowessPredictor(fit_lowess(data, hashes(data, "box_0"))[0])
    errors, sizes = [], []
    for row in held:
        pose = Pose.from_vector(attempts.pose_base_obj[row].astype(np.float64))
        grasp = Grasp.from_vector(attempts.grasp[row].astype(np.float64))
        found = predict_one(lowess, observation("box_0", pose), grasp, pose.position)
        errors.append(abs(found.mean[1] - attempts.displacement[row, 1]))
        sizes.append(abs(attempts.displacement[row, 1]))
    assert np.median(errors) < 0.5 * np.median(sizes)


def test_lowess_without_a_pose_or_of_an_unknown_part_is_an_error_of_one_line(data: Path):
    lowess = LowessPredictor(fit_lowess(data, hashes(data, "box_0"))[0])
    grasps = Grasp.from_vector(np.array([[0.45, 0.02, 0.015, 0.4]]))
    for part, pose in (("box_0", None), ("box_1", BOX.T_base_obj)):
        with pytest.raises(
            NoGraspFound, match=f"LOWESS needs the pose of '{part}' and recorded grasps of it"
        ):
            lowess.predict(observation(part, pose), grasps)


def test_a_folder_that_is_no_dataset_is_refused(tmp_path: Path):
    with pytest.raises(BadDataset):
        fit_lowess(tmp_path / "nowhere", ["box_0"])
