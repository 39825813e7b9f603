import dataclasses

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.learning.samples import joined_fingerprint, read_samples
from tests import synthetic
from tests.learning.small import HAND, PATCH


def test_samples_hold_every_attempt_with_its_displacement_seen_from_the_estimated_centre(samples):
    assert len(samples) == 640 and samples.patches.shape == (640, 1, 40, 40)
    assert len(samples.parts) == 8 and not samples.skipped
    held = samples.success
    assert bool(torch.isfinite(samples.grasp_displacement[held]).all())
    assert bool(torch.isnan(samples.grasp_displacement[~held]).all())
    # Closing the jaw centres a box: along y the displacement undoes the centre's offset, to a pixel.
    sideways = samples.displacement[held][:, 1] + samples.centre_grasp[held][:, 1]
    assert float(sideways.abs().max()) < 0.0025


def test_the_target_is_the_hands_motion_seen_from_the_part_whatever_centre_was_seen(dataset, samples):
    flip = Pose(position=np.zeros(3), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))  # of the TCP's frame, z down
    attempts = [read_shard(path)[0] for path in list_shards(dataset)]
    before, after = (
        flip @ Pose.from_vector(np.concatenate([getattr(one, name) for one in attempts]).astype(np.float64))
        for name in ("pose_tcp_obj_before", "pose_tcp_obj_after")
    )
    held = samples.success.numpy()
    motion, turn = (before @ after.inverse()).position[held], samples.displacement[held, 3].numpy()
    np.testing.assert_allclose(samples.grasp_displacement[held, :3], motion, atol=2e-6)
    np.testing.assert_allclose(samples.grasp_displacement[held, 3], -turn, atol=1e-6)
    np.testing.assert_allclose(samples.origin_grasp, before.position, atol=1e-6)
    same = np.abs((samples.quat_grasp_obj.numpy() * before.quat_wxyz).sum(axis=1))  # either sign
    np.testing.assert_allclose(same, 1.0, atol=1e-6)
    assert float((samples.origin_grasp - samples.centre_grasp)[:, :2].norm(dim=1).max()) > 3e-4


@pytest.mark.slow
@pytest.mark.parametrize("image", ["grasp", "object"])
def test_several_processes_read_the_same_samples(dataset, image):
    network = PATCH.network.model_copy(update={"image": image})
    one, two = (read_samples(dataset, network, workers=n) for n in (1, 2))
    for field in dataclasses.fields(one):
        first, second = getattr(one, field.name), getattr(two, field.name)
        if isinstance(first, torch.Tensor):
            assert first.dtype == second.dtype and np.array_equal(
                first, second, equal_nan=first.is_floating_point()
            )
        else:
            assert first == second
    assert (one.object_patches is None) == (image == "grasp")


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_damaged_shard_is_named_by_any_number_of_readers(tmp_path, workers):
    dataset = synthetic.write_dataset(tmp_path, n_parts=3, n_attempts=20, seed=0)
    bad = sorted((dataset / "shards").glob("*.h5"))[1]
    bad.write_bytes(bad.read_bytes()[:500])
    with pytest.raises(BadDataset, match=bad.name):
        read_samples(dataset, PATCH.network, workers=workers)


def test_parts_outside_the_success_range_are_left_out(dataset):
    samples = read_samples(dataset, PATCH.network)
    rates = sorted(
        float(samples.success[samples.part == i].double().mean()) for i in range(len(samples.parts))
    )
    middle = rates[len(rates) // 2]
    kept = samples.of_parts_between(0.0, middle)
    assert 0 < len(kept.parts) < len(samples.parts) and len(kept) < len(samples)
    for i, name in enumerate(kept.parts):
        rows = samples.part == samples.parts.index(name)
        assert float(kept.success[kept.part == i].double().mean()) <= middle
        assert torch.equal(kept.patches[kept.part == i], samples.patches[rows])
    with pytest.raises(BadDataset, match="widen success_range"):
        samples.of_parts_between(0.999, 0.9991)
    # The bounds belong to the range: 32 of 80, which is more than 0.4 in single precision.
    first = samples.part == 0
    success = samples.success.clone()
    success[first] = torch.arange(int(first.sum())) < 32
    assert int(first.sum()) == 80
    exact = dataclasses.replace(samples, success=success).of_parts_between(0.4, 0.4)
    assert exact.parts[0] == samples.parts[0]


def test_planned_attempts_join_those_of_the_same_parts(dataset, tmp_path):
    samples = read_samples(dataset, PATCH.network)
    other = read_samples(synthetic.write_dataset(tmp_path, n_parts=9, n_attempts=5, seed=3), PATCH.network)
    kept = samples.of_parts_between(0.0, float(samples.success.float().mean()))
    joined = kept.joined(other)
    assert joined.parts == kept.parts and 0 < len(kept.parts) < 8
    assert len(joined) == len(kept) + 5 * len(kept.parts)
    for number, name in enumerate(kept.parts):
        added = joined.patches[len(kept) :][joined.part[len(kept) :] == number]
        assert torch.equal(added, other.patches[other.part == other.parts.index(name)])
    assert torch.equal(joined.success[: len(kept)], kept.success)
    assert joined.fingerprint == joined_fingerprint(kept.fingerprint, other.fingerprint)
    assert joined.fingerprint != other.joined(kept).fingerprint
    foreign = dataclasses.replace(other, parts=tuple(f"other_{name}" for name in other.parts))
    with pytest.raises(BadDataset, match="no planned attempt is at a part of --data"):
        kept.joined(foreign)


def test_the_quality_network_sees_every_second_pixel_of_the_middle_columns(dataset):
    samples = read_samples(dataset, HAND.network)
    assert samples.patches.shape == (640, 1, 33, 33) and samples.patches.dtype == torch.int16
    rows = torch.tensor([3, 5])
    seen = samples.quality_patches_of(rows, "cpu", HAND.network)
    assert torch.equal(seen, samples.patches_of(rows, "cpu")[..., ::2, 8:25:2])
