import dataclasses

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.learning.samples import joined_fingerprint, part_sides, read_samples
from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import Index, entry_of, make_index, split_of, write_index
from mskgrasp.parts.recipes import cad, families
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


def held_out_of(names: tuple[str, ...], fraction: float) -> set[str]:
    return {name for name, side in part_sides(names, fraction, "name").items() if side == "validation"}


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


def test_parts_are_split_by_name_and_stay_on_their_side():
    names = tuple(f"part_{k}" for k in range(400))
    held_out = held_out_of(names, 0.2)
    assert 50 < len(held_out) < 110
    fewer = names[:200]
    assert held_out_of(fewer, 0.2) == held_out & set(fewer)
    assert all(len(held_out_of(("a", "b"), share)) == 1 for share in (0.01, 0.99))
    with pytest.raises(BadDataset, match="at least 2 parts"):
        part_sides(("lonely",), 0.2, "name")


def test_parts_outside_the_success_range_are_left_out(dataset):
    samples = read_samples(dataset, PATCH.network)
    rates = sorted(
        float(samples.success[samples.part == i].float().mean()) for i in range(len(samples.parts))
    )
    middle = rates[len(rates) // 2]
    kept = samples.of_parts_between(0.0, middle)
    assert 0 < len(kept.parts) < len(samples.parts) and len(kept) < len(samples)
    for i, name in enumerate(kept.parts):
        rows = samples.part == samples.parts.index(name)
        assert float(kept.success[kept.part == i].float().mean()) <= middle
        assert torch.equal(kept.patches[kept.part == i], samples.patches[rows])
    with pytest.raises(BadDataset, match="widen success_range"):
        samples.of_parts_between(0.999, 0.9991)


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


def test_the_catalogue_decides_the_sides_where_it_is_asked_to(monkeypatch, tmp_path):
    names = tuple(f"part_{k}" for k in range(6))
    with pytest.raises(BadDataset, match="build --catalogue"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        part_sides(names, 0.2, "catalogue")


def test_parts_that_were_not_built_here_are_on_the_side_of_their_family(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    write_index(make_index([entry_of(build_part("washer_m36").name)], {}, Index(parts={}, left_out={})))
    drawn = {recipe.name: split_of(recipe.family, "group 0") for recipe in cad.recipes()}
    sides = part_sides(("washer_m36", *drawn), 0.2, "catalogue")
    assert sides["washer_m36"] == split_of("washer", "washer_m36")
    for side in ("test", "validation"):
        assert {name for name in drawn if sides[name] == side} == {
            n for n, one in drawn.items() if one == side
        }


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """Names of parts by their side of the catalogue, of which one part is built."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("catalogue")))
        write_index(make_index([entry_of(build_part("washer_m36").name)], {}, Index(parts={}, left_out={})))
        names: dict[str, list[str]] = {}
        for recipe in families.recipes().values():
            names.setdefault(split_of(recipe.family, recipe.name), []).append(recipe.name)
        yield names


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        ({"train": 1, "test": 3}, "validation"),
        ({"test": 3}, "validation"),
        ({"new_sizes": 1, "test": 2}, "validation"),
        ({"validation": 1, "test": 3}, "train"),
        ({"validation": 3}, "train"),
        ({"train": 1, "new_sizes": 1}, "validation"),
        ({"new_sizes": 2}, "validation"),
    ],
    ids=str,
)
def test_a_side_without_parts_takes_none_of_the_held_out_families(named, numbers, missing):
    parts = tuple(name for side, n in numbers.items() for name in named[side][:n])
    with pytest.raises(BadDataset, match=f"no part is left for {missing} .*--parts {missing}, too"):
        part_sides(parts, 0.2, "catalogue")


def test_a_side_without_parts_takes_one_that_may_be_trained_on(named):
    held_out = {name: "test" for name in named["test"][:5]} | {named["new_sizes"][0]: "new_sizes"}
    others = tuple(named["train"][:2])
    sides = part_sides((*held_out, *others), 0.2, "catalogue")
    assert held_out.items() <= sides.items()
    assert {sides[name] for name in others} == {"train", "validation"}


def test_the_quality_network_sees_every_second_pixel_of_the_middle_columns(dataset):
    samples = read_samples(dataset, HAND.network)
    assert samples.patches.shape == (640, 1, 33, 33) and samples.patches.dtype == torch.int16
    rows = torch.tensor([3, 5])
    seen = samples.quality_patches_of(rows, "cpu", HAND.network)
    assert torch.equal(seen, samples.patches_of(rows, "cpu")[..., ::2, 8:25:2])
