"""The collector as users meet it: a program, its files, and what it survives."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from mskgrasp.dataset import list_shards, read_shard

REPOSITORY = Path(__file__).parents[2]
PARTS = ["parallel_key_a16x10x56", "hex_nut_m30"]


def command(out: Path, *options: str) -> list[str]:
    config = out.parent / "small.yaml"
    config.write_text(yaml.safe_dump(dict(parts=PARTS, attempts_per_part=6, shard_size=3, seed=5)))
    program = [sys.executable, "-m", "mskgrasp.collect"]
    return [*program, "--config", str(config), "--out", str(out), *options]


def collect(out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(out, *options), capture_output=True, text=True, cwd=REPOSITORY, timeout=280
    )


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small dataset made by one worker without any trouble."""
    out = tmp_path_factory.mktemp("undisturbed") / "data"
    done = collect(out, "--workers", "1")
    assert done.returncode == 0, done.stderr
    return out


def assert_equal(first: Path, second: Path) -> None:
    """Both datasets hold the same shards, byte by byte."""
    names = [path.name for path in list_shards(first)]
    assert names == [path.name for path in list_shards(second)]
    for name in names:
        one, two = (read_shard(folder / "shards" / name)[0] for folder in (first, second))
        for column, values in vars(one).items():
            assert np.array_equal(values, vars(two)[column], equal_nan=values.dtype.kind == "f"), column
        assert (first / "shards" / name).read_bytes() == (second / "shards" / name).read_bytes()


def test_a_run_leaves_shards_settings_summary_and_picture(undisturbed):
    assert len(list_shards(undisturbed)) == 4
    assert yaml.safe_load((undisturbed / "config.yaml").read_text())["seed"] == 5
    rows = json.loads((undisturbed / "summary.json").read_text())["parts"]
    assert [row["part"] for row in rows] == sorted(PARTS)
    assert sum(row["attempts"] for row in rows) == 12
    for row in rows:
        assert row["attempts"] == row["successes"] + sum(row["failures"].values())
    assert (undisturbed / "summary.png").read_bytes().startswith(b"\x89PNG")


def test_labels_obey_the_definitions(undisturbed):
    for path in list_shards(undisturbed):
        attempts, info = read_shard(path)
        assert attempts.depth.shape[1:] == (160, 160)
        assert (np.isnan(attempts.displacement).any(axis=1) == ~attempts.success).all()
        assert (attempts.failure[attempts.success] == 0).all()
        assert (attempts.failure[~attempts.success] > 0).all()
        held = attempts.displacement[attempts.success]
        assert (np.linalg.norm(held[:, :3], axis=1) < 0.05).all()
        assert (attempts.grasp[:, 2] >= 0.0105 - 1e-6).all()
        assert info.physics["rate_hz"] == 500


def test_two_workers_make_the_same_bytes_as_one(undisturbed, tmp_path):
    out = tmp_path / "data"
    assert collect(out, "--workers", "2").returncode == 0
    assert_equal(undisturbed, out)


def test_a_finished_run_has_nothing_left_to_do(undisturbed):
    stamps = [path.stat().st_mtime_ns for path in list_shards(undisturbed)]
    done = collect(undisturbed, "--workers", "2")
    assert done.returncode == 0 and "12 of them already there" in done.stdout
    assert [path.stat().st_mtime_ns for path in list_shards(undisturbed)] == stamps


def test_other_settings_are_refused_for_a_begun_dataset(undisturbed):
    done = collect(undisturbed, "--seed", "6")
    assert done.returncode == 1
    assert "seed differ" in done.stderr and len(done.stderr.strip().splitlines()) == 1


def children(pid: int) -> list[int]:
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True)
    return [int(word) for word in listed.stdout.split()]


def started(out: Path) -> subprocess.Popen[str]:
    """A collection of which the first shard lies on disk."""
    process = subprocess.Popen(
        command(out, "--workers", "1"),
        cwd=REPOSITORY, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    deadline = time.monotonic() + 120
    while not list((out / "shards").glob("*.h5")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    return process


def test_a_worker_that_is_killed_loses_nothing(undisturbed, tmp_path):
    out = tmp_path / "data"
    process = started(out)
    workers = [pid for pid in children(process.pid) if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    assert workers
    os.kill(workers[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=200)
    assert process.returncode == 0, errors
    assert "a worker died" in errors
    assert_equal(undisturbed, out)


def test_a_killed_collector_leaves_no_processes_and_resumes(undisturbed, tmp_path):
    out = tmp_path / "data"
    process = started(out)
    offspring = children(process.pid)
    process.kill()
    process.communicate(timeout=30)
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in offspring):
        assert time.monotonic() < deadline, "a worker outlived the collector"
        time.sleep(0.1)
    # A write that was cut short: it must be neither read nor kept.
    (out / "shards" / "hex_nut_m30-0001.h5.tmp").write_bytes(b"\x89HDF\r\n\x1a\n half a shard")
    assert collect(out).returncode == 0
    assert not list((out / "shards").glob("*.tmp"))
    assert_equal(undisturbed, out)


def test_ctrl_c_ends_cleanly_and_says_so(tmp_path):
    out = tmp_path / "data"
    process = started(out)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors and "what was finished is kept" in errors
    assert not list((out / "shards").glob("*.tmp"))
    for path in list_shards(out):
        read_shard(path)


def test_a_damaged_shard_is_made_again(undisturbed, tmp_path):
    out = tmp_path / "data"
    (out / "shards").mkdir(parents=True)
    (out / "config.yaml").write_bytes((undisturbed / "config.yaml").read_bytes())
    for path in list_shards(undisturbed):
        (out / "shards" / path.name).write_bytes(path.read_bytes())
    victim = list_shards(out)[0]
    victim.write_bytes(victim.read_bytes()[:2000])
    done = collect(out)
    assert done.returncode == 0 and "making again" in done.stderr and victim.name in done.stderr
    assert_equal(undisturbed, out)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("atempts_per_part: 3", "unknown key 'atempts_per_part'"),
        ("physics: {rate_hz: 100}", "'physics.rate_hz'"),
        ("[1, 2]", "expected a mapping"),
        ("parts: [", "not valid YAML"),
        ("parts: [no_such_part]", "no_such_part"),
    ],
)
def test_a_wrong_configuration_is_one_line_that_names_it(tmp_path, text, message):
    config = tmp_path / "wrong.yaml"
    config.write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "mskgrasp.collect", "--config", str(config), "--out", str(tmp_path / "data")],
        capture_output=True, text=True, cwd=REPOSITORY, timeout=120,
    )  # fmt: skip
    assert done.returncode == (1 if "no_such_part" in text else 2)
    assert message in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "data").exists()
