"""The collector as users meet it: a program, its files, and what it survives."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import trimesh
import yaml

from mskgrasp.collect import run
from mskgrasp.collect.__main__ import main
from mskgrasp.collect.config import CollectConfig, PartFilter
from mskgrasp.collect.run import check_out, chosen_parts, is_done
from mskgrasp.collect.workers import leave_out
from mskgrasp.core.config import read_config, write_config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import exclusive_lock
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.dataset import list_shards, read_shard, read_success, shard_path
from mskgrasp.dataset.labels import export_labels
from mskgrasp.parts import store
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.write_solid import write_solid
from mskgrasp.simulation.planned_grasps import planner_digest
from mskgrasp.simulation.shard_task import ShardTask
from tests.collecting import PARTS, REPOSITORY, arguments, assert_equal, collect, command
from tests.programs import no_file_opens, run_here


def test_a_run_leaves_shards_settings_summary_and_picture(collected):
    assert len(list_shards(collected)) == 4
    assert yaml.safe_load((collected / "config.yaml").read_text())["seed"] == 5
    rows = json.loads((collected / "summary.json").read_text())["parts"]
    assert [row["part"] for row in rows] == sorted(PARTS)
    assert sum(row["attempts"] for row in rows) == 12
    for row in rows:
        assert row["attempts"] == row["successes"] + sum(row["failures"].values())
    assert (collected / "summary.png").read_bytes().startswith(b"\x89PNG")


def test_labels_obey_the_definitions(collected):
    for path in list_shards(collected):
        attempts, info = read_shard(path)
        assert attempts.depth.shape[1:] == (160, 160)
        assert (np.isnan(attempts.displacement).any(axis=1) == ~attempts.success).all()
        assert (attempts.failure[attempts.success] == 0).all()
        assert (attempts.failure[~attempts.success] > 0).all()
        held = attempts.displacement[attempts.success]
        assert (np.linalg.norm(held[:, :3], axis=1) < 0.05).all()
        assert (attempts.grasp[:, 2] >= 0.0105 - 1e-6).all()
        assert info.physics["rate_hz"] == 1000


def test_a_finished_run_has_nothing_left_to_do(collected):
    stamps = [path.stat().st_mtime_ns for path in list_shards(collected)]
    done = run_here(main, *arguments(collected, "--workers", "2"))
    assert done.returncode == 0 and "12 of them already there" in done.stdout
    assert [path.stat().st_mtime_ns for path in list_shards(collected)] == stamps


def test_other_settings_are_refused_for_an_existing_dataset(collected):
    done = run_here(main, *arguments(collected, "--seed", "6"))
    assert done.returncode == 2
    assert "seed differ" in done.stderr and len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
def test_grasps_are_planned_alike_by_one_worker_and_by_two(tmp_path):
    planned = ("--planned-by", str(PRETRAINED))
    for n in ("1", "2"):
        done = collect(tmp_path / n, *planned, "--workers", n)
        assert done.returncode == 0, done.stderr
    assert_equal(tmp_path / "1", tmp_path / "2")
    infos = [read_shard(path)[1] for path in list_shards(tmp_path / "1")]
    assert {info.planner for info in infos} == {planner_digest(PRETRAINED)}
    done = run_here(main, *arguments(tmp_path / "1"))
    assert done.returncode == 2 and "planned_by differ" in done.stderr


def workers(pid: int) -> list[int]:
    """The collector's processes that simulate."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        if int(fields[1]) == pid and b"spawn_main" in (status.parent / "cmdline").read_bytes():
            found.append(int(status.parent.name))
    return found


def started(out: Path, *options: str) -> subprocess.Popen[str]:
    """A collection at work: it has written one shard more than there were."""
    before = len(list((out / "shards").glob("*.h5")))
    process = subprocess.Popen(
        command(out, *options),
        cwd=REPOSITORY, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    deadline = time.monotonic() + 120
    while len(list((out / "shards").glob("*.h5"))) <= before:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    return process


@pytest.mark.slow
def test_stopped_killed_and_damaged_a_run_still_ends_in_the_same_bytes(collected, tmp_path):
    out = tmp_path / "data"
    process = started(out, "--workers", "1")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors and "what was finished is kept" in errors
    assert not list((out / "shards").glob("*.tmp"))
    finished = list_shards(out)
    for path in finished:
        read_shard(path)

    process = started(out, "--workers", "2")
    offspring = workers(process.pid)
    process.kill()
    process.communicate(timeout=30)
    deadline = time.monotonic() + 20
    assert len(offspring) == 2
    while any(Path(f"/proc/{pid}").exists() for pid in offspring):
        assert time.monotonic() < deadline, "a worker outlived the collector"
        time.sleep(0.1)

    # A write that was cut short, and a file that lost its end: neither may be read or kept.
    (out / "shards" / "hex_nut_m30-0001.h5.tmp").write_bytes(b"\x89HDF\r\n\x1a\n half a shard")
    finished[0].write_bytes(finished[0].read_bytes()[:2000])
    process = subprocess.Popen(
        command(out, "--workers", "2"),
        cwd=REPOSITORY, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    deadline = time.monotonic() + 120
    while not (busy := workers(process.pid)):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    os.kill(busy[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=250)
    assert process.returncode == 0, errors
    assert "making again" in errors and finished[0].name in errors and "a worker died" in errors
    assert not list((out / "shards").glob("*.tmp"))
    assert_equal(collected, out)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("atempts_per_part: 3", 2, "unknown key 'atempts_per_part'"),
        ("physics: {rate_hz: 100}", 2, "physics.rate_hz is at least 250"),
        ("physics: {coarse_rate_hz: 125}", 2, "physics.coarse_rate_hz is at least 250"),
        ("[1, 2]", 2, "expected a mapping"),
        ("parts: [", 2, "not valid YAML"),
        ("parts: [no_such_part]", 2, "no_such_part"),
        ("camera: {height: 0.31}", 2, "the camera sees 0.14 m"),
        ("physics: {friction_table_part: -0.1}", 2, "physics.friction_table_part"),
        ("part_filter: {min_length: 1.0}\nparts: [hex_nut_m30]", 2, "no part is left"),
        ("planned_by: /nowhere\nparts: [hex_nut_m30]", 2, "no model.json in /nowhere; train a model"),
        ("planned_by: /nowhere\ncluster: auto", 2, "grasps are planned by this machine's processes alone"),
        ("planned_by: /nowhere\npart_filter: {min_success: 0.1}", 2, "these are planned: leave them out"),
    ],
)
def test_a_wrong_configuration_is_one_line_that_names_it(tmp_path, text, code, message):
    config = tmp_path / "wrong.yaml"
    config.write_text(text)
    done = run_here(main, "--config", str(config), "--out", str(tmp_path / "data"))
    assert done.returncode == code
    assert message in done.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "data").exists()


def test_coarse_parts_are_left_out_unless_asked_for(tmp_path, capsys):
    solid = Solid(
        mesh=trimesh.creation.annulus(8, 20, 20), hulls=(np.array(s.prism(s.polygon(20, 16), 0, 20)),)
    )
    with store.kept_in(tmp_path):
        part = write_solid(
            solid, name="plugged", family="test", source="own", licence="CC0-1.0", density=1000.0,
            dimensions={}, recipe_hash="0", coarse=True,
        )  # fmt: skip
        config = CollectConfig(parts=(str(part.folder), "hex_nut_m30"))
        assert [one.name for _, one in chosen_parts(config)] == ["hex_nut_m30"]
        assert "left out plugged: coarse, 95 % of its surface is within" in capsys.readouterr().err
        config = config.model_copy(update={"part_filter": PartFilter(coarse=True)})
        assert [one.name for _, one in chosen_parts(config)] == ["plugged", "hex_nut_m30"]


def test_a_dataset_made_with_settings_that_no_longer_exist_is_not_added_to(collected, tmp_path):
    out = Path(shutil.copytree(collected, tmp_path / "data"))
    settings = yaml.safe_load((out / "config.yaml").read_text())
    settings["physics"]["coarse_mass"] = 0.04  # as simulation version 2 stored it
    (out / "config.yaml").write_text(yaml.safe_dump(settings))
    with pytest.raises(UsageError, match=r"unknown key 'physics.coarse_mass'; .*; choose another --out"):
        check_out(CollectConfig(out=out))


def test_shards_of_other_software_are_not_added_to(collected, tmp_path):
    path = list_shards(collected)[0]
    info = read_shard(path)[1]
    task = ShardTask(part=info.part, folder="", index=info.index, first=0, n=3, seed=info.seed)
    assert is_done(collected, task, info.part_hash)
    assert not is_done(collected, replace(task, n=4), info.part_hash)
    assert not is_done(collected, replace(task, seed=1), info.part_hash)
    out = tmp_path / "data"
    shutil.copytree(collected, out)
    shutil.copy(path, shard_path(out, info.part, 9))
    assert not is_done(out, replace(task, index=9), info.part_hash)  # another's copy
    with h5py.File(out / "shards" / path.name, "r+") as file:
        file.attrs["versions"] = json.dumps(info.versions | {"simulation": "0123456789abcdef"})
    with pytest.raises(BadDataset, match="other software: simulation 0123456789abcdef"):
        is_done(out, task, info.part_hash)
    with h5py.File(out / "shards" / path.name, "r+") as file:
        file.attrs["fidelity"] = "gpu"
    with pytest.raises(BadDataset, match="labels of fidelity 'gpu'"):
        is_done(out, task, info.part_hash)
    with pytest.raises(BadDataset, match=r"made with random grasps, this run with planner 0123; .*--labels"):
        is_done(collected, task, info.part_hash, planner="0123")


def test_a_shard_that_the_system_cannot_open_ends_the_run_and_is_not_made_again(collected):
    path = list_shards(collected)[0]
    info = read_shard(path)[1]
    task = ShardTask(part=info.part, folder="", index=info.index, first=0, n=3, seed=info.seed)

    def main() -> int:
        with no_file_opens():
            return int(is_done(collected, task, info.part_hash))

    done = run_here(main)
    remedy = "raise the limit of open files: ulimit -n 4096"
    assert (done.returncode, done.stderr) == (1, f"program: Too many open files: {path}; {remedy}\n")


def test_a_collection_from_labels_of_other_software_is_resumed_with_them(collected, tmp_path):
    out = Path(shutil.copytree(collected, tmp_path / "data"))
    for path in list_shards(out):
        with h5py.File(path, "r+") as file:
            stated = json.loads(file.attrs["versions"]) | {"python": "3.11.0"}
            file.attrs["versions"] = json.dumps(stated)
    export_labels(out, tmp_path / "all.labels")
    done = run_here(main, *arguments(out, "--labels", str(tmp_path / "all.labels")))
    assert done.returncode == 0, done.stderr
    assert "12 attempts" in done.stdout and "12 of them already there" in done.stdout
    for options in ((), ("--labels", str(tmp_path / "own.labels"))):
        if options:
            export_labels(collected, tmp_path / "own.labels")
        done = run_here(main, *arguments(out, *options))
        assert done.returncode == 1 and "was made by other software: python 3.11.0" in done.stderr


def test_two_collections_do_not_write_into_one_folder(collected, tmp_path):
    out = tmp_path / "data"
    shutil.copytree(collected, out)
    with exclusive_lock(out) as alone, exclusive_lock(out) as both:
        assert alone and not both
        done = run_here(main, *arguments(out))
    assert done.returncode == 2 and "another collection is writing" in done.stderr
    with exclusive_lock(out) as alone:
        assert alone


@pytest.mark.slow
def test_settings_that_another_run_has_written_meanwhile_are_seen(tmp_path, monkeypatch):
    out = tmp_path / "data"

    @contextmanager
    def after_another(folder: Path) -> Iterator[bool]:
        another = read_config(CollectConfig, tmp_path / "small.yaml").model_copy(update={"seed": 6})
        write_config(another, out / "config.yaml")
        with exclusive_lock(folder) as alone:
            yield alone

    monkeypatch.setattr(run, "exclusive_lock", after_another)
    done = run_here(main, *arguments(out))
    assert done.returncode == 2 and "made with other settings (seed differ)" in done.stderr
    assert not (out / "shards").exists()


def test_a_wrong_folder_is_refused_before_parts_are_built(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "chosen_parts", lambda config: pytest.fail("parts are built"))
    (tmp_path / "notes.txt").touch()
    done = run_here(main, *arguments(tmp_path / "notes.txt"))
    assert done.returncode == 2 and "is a file; choose a folder" in done.stderr


def test_a_collection_goes_on_without_a_part_as_its_error_says(collected, tmp_path):
    out = tmp_path / "data"
    shutil.copytree(collected, out)
    lost = PARTS[0]
    for path in (out / "shards").glob(f"{lost}-*"):
        path.unlink()
    assert str(out / "config.yaml") in leave_out(out)
    settings = yaml.safe_load((out / "config.yaml").read_text())
    settings["parts"].remove(lost)
    (out / "config.yaml").write_text(yaml.safe_dump(settings))
    done = run_here(main, *shlex.split(leave_out(out).partition("mskgrasp.collect ")[2]))
    assert done.returncode == 0, done.stderr
    assert f"1 parts, 6 attempts into {out}, 6 of them already there" in done.stdout


def test_parts_that_the_first_shard_shows_outside_the_filter_get_no_further_shards(collected, tmp_path):
    export_labels(collected, tmp_path / "all.labels")
    rates = {part: read_success(shard_path(collected, part, 0))[0].mean() for part in PARTS}
    for side in ("min", "max"):
        out = tmp_path / side
        bound = (f"--part-filter.{side}-success", f"{min(rates.values()) - 0.01:.6f}")
        passing = PARTS if side == "min" else ()
        for _ in range(2):  # the second run finds all that is needed
            done = run_here(main, *arguments(out, "--labels", str(tmp_path / "all.labels"), *bound))
            assert done.returncode == 0, done.stderr
            assert f"{len(passing)} parts pass the part filter" in done.stdout
            assert [path.name for path in list_shards(out)] == [
                shard_path(out, part, index).name
                for part in sorted(PARTS)
                for index in range(2 if part in passing else 1)
            ]


@pytest.mark.slow
def test_a_dataset_is_made_again_from_its_labels_but_for_a_part_that_has_changed(collected, tmp_path):
    labels, again = tmp_path / "all.labels", tmp_path / "again"
    export_labels(collected, labels)
    with h5py.File(labels, "r+") as file:
        shards = json.loads(file["shards"][:].tobytes())
        changed = shards[0]["part"]
        shards[0]["part_hash"] = "0" * 16
        del file["shards"]
        file["shards"] = np.frombuffer(json.dumps(shards).encode(), np.uint8)
    done = collect(again, "--labels", str(labels), "--workers", "1")
    assert done.returncode == 0, done.stderr
    assert "1 of 2 parts are not exactly those of --labels" in done.stderr
    for path in list_shards(collected):
        (one, _), (two, info) = read_shard(path), read_shard(again / "shards" / path.name)
        assert info.part_hash != "0" * 16 and np.array_equal(one.grasp, two.grasp)
        if info.part != changed:
            assert np.array_equal(one.depth, two.depth) and np.array_equal(one.failure, two.failure)


@pytest.mark.parametrize(
    ("labels", "option", "value", "code", "message"),
    [
        ("all", "--seed", "6", 2, "other settings (seed differ)"),
        ("all", "--camera.height", "0.9", 2, "other settings (camera.height differ)"),
        ("all", "--shard-size", "5", 2, "are not those of attempts 0 to 4 of seed"),
        ("none", "--seed", "5", 2, "no file of labels"),
    ],
)
def test_labels_of_another_dataset_or_none_are_refused(
    collected, tmp_path, labels, option, value, code, message
):
    export_labels(collected, tmp_path / "all.labels")
    chosen = ("--labels", str(tmp_path / f"{labels}.labels"), option, value)
    done = run_here(main, *arguments(tmp_path / "other", *chosen))
    assert done.returncode == code and message in done.stderr
    assert not (tmp_path / "other").exists()
