"""The commands that build, list and draw: resumable, stopped at any time, and what was left out."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mskgrasp.core.errors import MskgraspError
from mskgrasp.parts import build_part, read_part, starter_names
from mskgrasp.parts.catalogue import (
    Index,
    Rating,
    entry_of,
    make_index,
    read_index,
    with_ratings,
    write_index,
)
from mskgrasp.parts.commands import build as build_command
from mskgrasp.parts.commands.build_parts import build_parts
from mskgrasp.parts.commands.command_line import main

EMPTY = Index(parts={}, left_out={})
NAMES = ("hex_nut_m20", "parallel_key_b20x12x80", "parallel_pin_12x60", "washer_m36")


@pytest.mark.slow
def test_the_program_builds_lists_and_draws(capsys, tmp_path):
    assert main(["build", *NAMES, "--workers", "1"]) == 0
    assert "4 parts ready, 4 built now" in capsys.readouterr().out
    entries = [built.entry for built in build_parts(NAMES, EMPTY, 1)]
    write_index(make_index([entry for entry in entries if entry], {}, EMPTY))
    assert main(["list", "--catalogue", "--csv", str(tmp_path / "catalogue.csv")]) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == "4 parts"
    assert "hex_nut" in out and "longest axis: 20-40 mm 1, 40-60 mm 0, 60-80 mm 2" in out
    rows = (tmp_path / "catalogue.csv").read_text().splitlines()
    assert len(rows) == 5 and rows[1].startswith("hex_nut_m20,hex_nut,ISO 4032,Apache-2.0,train,hex_nut_m20")
    assert main(["list", "--family", "washer"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "1 parts"
    assert main(["sheet", "--out", str(tmp_path / "new" / "sheet.png"), "--parts", "4"]) == 0
    assert (tmp_path / "new" / "sheet.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "exit_code"),
    [
        (("build", "washer_m63"), 2),
        (("build", "washer_m36", "--catalogue"), 2),
        (("build", "--workers", "-1"), 2),
        (("sheet", "--out", "sheet.doc"), 2),
        (("list", "--catalogue"), 1),
        (("list", "--family", "washer"), 1),
        (("sheet",), 1),
        (("rate", "--data", "nowhere"), 2),
    ],
)
def test_mistakes_are_reported_in_one_line(arguments, exit_code):
    with pytest.raises(MskgraspError) as caught:
        main(arguments)
    assert caught.value.exit_code == exit_code and "\n" not in str(caught.value)


def test_a_build_of_the_catalogue_that_is_stopped_keeps_the_rest_of_the_index(monkeypatch):
    for name in NAMES:
        build_part(name)
    index = make_index([entry_of(name) for name in NAMES], {}, EMPTY)
    washer = index.parts["washer_m36"]
    rating = Rating(
        attempts=9, successes=3, interval=(0.1, 0.6), part_hash=washer.content_hash, dataset="data"
    )
    write_index(with_ratings(index, {washer.name: rating}))

    def stopped_after_one(names, before, workers):
        yield next(build_parts(["hex_nut_m20"], before, workers))
        raise KeyboardInterrupt

    monkeypatch.setattr(build_command, "build_parts", stopped_after_one)
    with pytest.raises(KeyboardInterrupt):
        main(["build", "--catalogue"])
    assert set(read_index().parts) == set(NAMES)
    assert read_index().parts["washer_m36"].rating == rating


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_build_that_is_stopped_leaves_whole_parts_and_goes_on(own_cache, how):
    code = (
        "from mskgrasp.parts.commands.command_line import main; "
        "from mskgrasp.runtime.cli import run; run('mskgrasp.parts', main)"
    )
    build = subprocess.Popen(
        [sys.executable, "-c", code, "build", "--workers", "2"],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # where the tests' own is ignored
        start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 300
    while not list(own_cache.glob("[a-z]*")) and time.monotonic() < deadline:
        time.sleep(0.01)
    os.killpg(build.pid, how)  # as a terminal does: the program and its workers
    _, said = build.communicate(timeout=30)
    assert build.returncode in (130, -signal.SIGKILL)
    if how == signal.SIGINT:
        assert said.splitlines() == ["stopped by Ctrl-C; what was finished is kept"]
    finished = [folder.name for folder in own_cache.glob("[a-z]*")]
    assert 1 <= len(finished) < len(starter_names())
    assert all(read_part(own_cache / name).name == name for name in finished)
    some = [*finished[:2], "parallel_pin_20x100"]
    seconds = {built.name: built.seconds for built in build_parts(some, read_index(), 1)}
    assert all(seconds[name] == 0 for name in finished[:2])


@pytest.mark.slow
def test_workers_of_a_killed_build_end_too(own_cache):
    code = (
        "from mskgrasp.parts.commands.command_line import main; "
        "from mskgrasp.runtime.cli import run; run('mskgrasp.parts', main)"
    )
    build = subprocess.Popen(
        [sys.executable, "-c", code, "build", "--workers", "2"],
        start_new_session=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    deadline = time.monotonic() + 300
    while not list(own_cache.glob("[a-z]*")) and time.monotonic() < deadline:
        time.sleep(0.01)
    build.kill()  # it alone, as the system does when memory is short
    build.wait(30)
    deadline = time.monotonic() + 60
    while (left := processes_of_group(build.pid)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not left


def processes_of_group(group: int) -> list[int]:
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, its_group = (folder / "stat").read_text().rsplit(")", 1)[1].split()[:3]
        except OSError:
            continue
        if int(its_group) == group and state != "Z":
            found.append(int(folder.name))
    return found
