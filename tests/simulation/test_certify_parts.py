"""Certified grasps of whole parts: the same whatever the workers, and resumed where they were stopped."""

from __future__ import annotations

import dataclasses
import json

import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.core.settings import Physics
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.planning.certified import FILE, certified_folder, read_certified
from mskgrasp.simulation import certify_parts, resting
from mskgrasp.simulation.certify import CertifyConfig
from mskgrasp.simulation.certify_parts import certify, certify_config
from mskgrasp.simulation.hull_count import USUAL_HULLS
from mskgrasp.simulation.versions import versions
from tests.boxes import make_box
from tests.planning.test_certified import certified, certified_grasp

CONFIG = CertifyConfig(simulations=48, per_stream=24, physics=Physics(rate_hz=500, position_iterations=15))


@pytest.fixture
def box(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return make_box(tmp_path, "box", (0.07, 0.03, 0.02), 0.1)


@pytest.mark.slow
def test_a_stopped_certification_goes_on_and_gives_the_bytes_of_two_workers(box, monkeypatch):
    folder = str(box.folder)
    written = []
    whole = certify_parts._write_stream

    def once(*arguments):
        if written:
            raise KeyboardInterrupt
        written.append(whole(*arguments))

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(certify_parts, "_write_stream", once)
        certify([folder], CONFIG, PRETRAINED, 1, hidden=True)
    (first,) = (certified_folder(box)).glob("*/*.json")
    stamp = first.stat().st_mtime_ns
    found = certify([folder], CONFIG, PRETRAINED, 1, hidden=True)[box.name]
    assert first.stat().st_mtime_ns == stamp  # not made again
    by_one = (certified_folder(box) / FILE).read_bytes()
    for path in certified_folder(box).glob("*/*.json"):
        path.unlink()
    certify([folder], CONFIG, PRETRAINED, 2, hidden=True)
    assert (certified_folder(box) / FILE).read_bytes() == by_one
    # A box lies on its largest side nearly always, and four such poses are one.
    assert {grasp.resting for grasp in found.grasps} | set(found.without) >= {0}
    assert found.grasps, found.without
    assert read_certified(box).grasps[0].to_json() == found.grasps[0].to_json()
    best = found.grasps[0]
    assert best.lifted == best.n


def test_of_a_part_all_of_whose_resting_poses_are_rare_the_likeliest_is_certified(box):
    rare = CONFIG.model_copy(update={"least_probability": 1.0})
    found = certify([str(box.folder)], rare, PRETRAINED, 1, hidden=True)[box.name]
    assert {grasp.resting for grasp in (*found.grasps, *found.uncertified)} == {0}
    assert found.without and all("it is rare" in reason for reason in found.without.values())
    assert read_certified(box).without == found.without


def test_a_part_that_stands_in_no_resting_pose_is_refused_in_a_line(box):
    cached = resting._cached(box, CONFIG.physics)
    cached.parent.mkdir(parents=True)
    cached.write_text(json.dumps(dict(part=box.name, stands=[False] * len(box.resting_probability))))
    with pytest.raises(BadPart, match="'box' topples in the simulation in every resting pose"):
        certify([str(box.folder)], CONFIG, PRETRAINED, 1, hidden=True)
    assert not certified_folder(box).exists()


@pytest.mark.parametrize(
    ("changes", "made_again"),
    [
        (dict(), False),
        (dict(simulations=400), False),
        (dict(versions=dict(simulation="0")), True),
        (dict(versions=None), True),
        (dict(certify_version=0), True),
        (dict(select_version=0), True),
        (dict(pose_errors=dict(position=0.0, height=0.0, turn=0.0)), True),
        (dict(clearance=0.003), False),
        (dict(clearance=0.001), True),
        (dict(clearance=None), True),
    ],
)
def test_grasps_of_another_simulation_or_conditions_are_made_again(box, monkeypatch, changes, made_again):
    conditions = CertifyConfig(clearance=0.002).model_dump(mode="json") | dict(
        certify_version=certify_parts.CERTIFY_VERSION,
        select_version=certify_parts.SELECT_VERSION,
        versions=versions(),
    )
    stored = certified(
        certified_grasp(), part=box.name, part_hash=box.content_hash, conditions=conditions | changes,
        like={}, without={}, stands=(True,) * len(box.resting_probability),
    )  # fmt: skip
    certified_folder(box).mkdir(parents=True)
    stored.write(certified_folder(box))
    wanted = []
    monkeypatch.setattr(certify_parts, "certify", lambda parts, *rest: wanted.extend(parts))
    certify_parts.certify_missing([str(box.folder)], PRETRAINED, 1, clearance=0.002)
    assert wanted == [str(box.folder)] * made_again


def test_missing_grasps_of_parts_of_many_pieces_are_certified_by_fewer_simulations(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    parts = {name: make_box(tmp_path, name, (0.07, 0.03, 0.02), 0.1) for name in ("few", "many", "as_few")}
    parts["many"] = dataclasses.replace(parts["many"], n_hulls=3 * USUAL_HULLS)
    monkeypatch.setattr(certify_parts, "find_part", parts.__getitem__)
    made = []
    monkeypatch.setattr(certify_parts, "certify", lambda *values: made.append(values[:2]))
    certify_parts.certify_missing(list(parts), PRETRAINED, 1)
    usual = CertifyConfig()
    fewer = usual.model_copy(update=dict(simulations=usual.simulations // 3))
    assert made == [(["few", "as_few"], usual), (["many"], fewer)]


@pytest.mark.parametrize(
    ("simulations", "per_stream"), [(24, 24), (30, 30), (151, 75), (400, 200), (1200, 200)]
)
def test_simulations_of_a_single_pose_keep_two_cores_busy_if_they_suffice(simulations, per_stream):
    found = certify_config(simulations)
    assert (found.simulations, found.per_stream) == (simulations, per_stream)


def test_rarer_poses_are_left_out_if_so_asked():
    assert certify_config(400, factor=2.5).least_probability == 2.5 * CertifyConfig().least_probability


@pytest.mark.slow
def test_pads_keep_the_clearance_in_every_simulated_grasp(box):
    config = CONFIG.model_copy(update=dict(clearance=0.004, least_probability=1.0))
    found = certify([str(box.folder)], config, PRETRAINED, 1, hidden=True)[box.name]
    heights = [grasp.grasp[2] - PAD_REACH for grasp in (*found.grasps, *found.uncertified)]
    assert found.grasps and min(heights) >= 0.004 - 1e-9
    assert read_certified(box).conditions["clearance"] == 0.004
