"""``parts import`` as a user calls it: many files, one table."""

import os
import re
import resource
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import UsageError
from mskgrasp.parts import read_part
from mskgrasp.parts.commands.import_ import Import, run_import


def box(file: Path, *size: float, at=(0.0, 0.0, 0.0)) -> Path:
    mesh = trimesh.creation.box(size or (40, 30, 20))
    mesh.apply_translation(at)
    mesh.export(file)
    return file


def table_lines(stdout: str) -> list[str]:
    """Header, rows and the line below the table."""
    return [line for line in stdout.splitlines() if line.strip("─")]


def table(stdout: str) -> dict[str, str]:
    """The rows of the table by the file's name."""
    lines = table_lines(stdout)
    assert (
        lines[0].split()
        == (
            "file part result size mm mass g hulls grade error p95 mm max mm repairs, or reason of refusal"
        ).split()
    )
    return {re.split(r"\s{2,}", line)[0]: line for line in lines[1:-1]}


@pytest.mark.slow
def test_a_folder_with_all_a_user_may_have_in_it(program, tmp_path, own_cache):
    folder = tmp_path / "CAD Daten für Köln"
    (folder / "unten").mkdir(parents=True)
    box(folder / "Gehäuse oben.stl")
    box(folder / "unten" / "below.stl")
    box(tmp_path / "outside.stl")
    (folder / "linked.stl").symlink_to(tmp_path / "outside.stl")
    (folder / "inner link.stl").symlink_to(folder / "Gehäuse oben.stl")
    (folder / "dangling.stl").symlink_to(folder / "nowhere.stl")
    (folder / "folder.stl").mkdir()
    (folder / "empty.stl").touch()
    (folder / "letter.stl").write_text("Dear colleague,\n" * 30)
    (folder / "cut.stl").write_bytes((tmp_path / "outside.stl").read_bytes()[:300])
    (folder / "readme.txt").write_text("not CAD")
    box(folder / "metre.stl", 1000, 50, 50)
    box(folder / "sheet.stl", 60, 40, 1)
    corners = [[0, 0, 0], [50, 0, 0], [0, 50, 0]]
    trimesh.Trimesh(corners, [[0, 1, 2]], process=False).export(folder / "flat.stl")
    done = program("import", str(folder), "--density", "1000")
    assert done.returncode == 1
    rows = {Path(name).name: row for name, row in table(done.stdout).items()}
    wanted = {
        "Gehäuse oben.stl": r"gehaeuse-oben\s+imported\s+40\.0 x 30\.0 x 20\.0\s+24\s+1\s+fine\s+0",
        "inner link.stl": r"inner-link\s+imported",
        "sheet.stl": r"imported\s+60\.0 x 40\.0 x 1\.0\s+2\.4 ",
        "linked.stl": r"refused\s+leads out of .*CAD Daten für Köln to .*/outside\.stl: give that",
        "dangling.stl": r"refused\s+is a link to .*nowhere\.stl, which does not exist",
        "empty.stl": r"refused\s+is empty",
        "letter.stl": r"refused\s+is not an STL \(text",
        "cut.stl": r"refused\s+is cut off: its header states 12 triangles, the file ends after 4",
        "metre.stl": r"refused\s+is 1 m long .* no other --unit makes it fit",
        "flat.stl": r"refused\s+is a flat sheet",
    }
    assert set(rows) == set(wanted)
    for name, pattern in wanted.items():
        assert re.search(pattern, rows[name]), rows[name]
    assert done.stdout.splitlines()[-1].startswith("3 of 10 files imported, in ")
    errors = done.stderr.splitlines()
    assert sum(line.startswith("error: ") for line in errors) == 7
    assert errors[-1] == "skipped readme.txt: not CAD files by their suffix"
    assert {path.name for path in own_cache.iterdir()} == {"gehaeuse-oben", "inner-link", "sheet"}
    # What the folder must not bring in is imported when it is named.
    assert program("import", str(folder / "linked.stl")).returncode == 0


@dataclass(frozen=True)
class Run:
    code: int
    stdout: str
    stderr: str


@pytest.fixture
def importing(tmp_path, monkeypatch, capsys) -> Callable[..., Run]:
    """Runs the command in this process and in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*files: str, **options: Any) -> Run:
        options = dict(workers=1) | options  # every process takes seconds to start
        code = run_import(Import(files=tuple(Path(file) for file in files), **options))
        captured = capsys.readouterr()
        return Run(code, captured.out, captured.err)

    return run


def test_patterns_are_expanded_here_and_a_second_run_changes_nothing(importing, tmp_path):
    (tmp_path / "a b" / "deep").mkdir(parents=True)
    box(tmp_path / "a b" / "one.stl")
    box(tmp_path / "a b" / "deep" / "two.obj")
    (tmp_path / "a b" / "deep" / "notes.txt").write_text("x")
    done = importing("a b/**/*", "a b/one.stl")
    assert done.code == 0 and list(table(done.stdout)) == ["a b/deep/two.obj", "a b/one.stl"]
    again = importing("a b/**/*.*", density=7850)
    assert again.code == 0
    assert all(" unchanged " in row for row in table(again.stdout).values())
    lighter = importing("a b/one.stl", density=2700)
    assert "replaced the part of that name" in lighter.stdout
    assert "64.8" in table(lighter.stdout)["a b/one.stl"]


def test_mistakes_of_the_command_line_are_reported_in_one_line(importing, tmp_path):
    (tmp_path / "bare").mkdir()
    box(tmp_path / "box.stl")
    for file, options, said in (
        ("*.step", {}, "no file matches *.step"),
        ("bare", {}, "the folder bare holds no CAD file"),
        ("gone.stl", {}, "there is no file or folder gone.stl"),
        ("box.stl", {"split": True, "union": True}, "--split and --union exclude each other"),
        ("box.stl", {"density": 7.85}, "in kg/m^3, not g/cm^3"),
        ("box.stl", {"workers": -1}, "--workers -1: give a number of processes"),
    ):
        with pytest.raises(UsageError) as caught:
            importing(file, **options)
        assert said in str(caught.value) and "\n" not in str(caught.value)


def test_repairs_parts_and_names_are_in_the_table(importing, tmp_path):
    first, second = trimesh.creation.box((40, 30, 20)), trimesh.creation.box((30, 20, 10))
    second.apply_translation((60, 0, 0))
    second.invert()
    trimesh.util.concatenate([first, second]).export(tmp_path / "pair.stl")
    (tmp_path / "else").mkdir()
    box(tmp_path / "else" / "Pair-1.ply")
    done = importing("pair.stl", "else/Pair-1.ply", split=True)
    assert done.code == 1
    lines = table_lines(done.stdout)
    assert re.search(
        r"^pair\.stl\s+pair-1\s+repaired .* turned 12 faces outward; split into 2 parts$", lines[1]
    )
    assert re.search(r"^\s+pair-2\s+30\.0 x 20\.0 x 10\.0", lines[2])
    assert "would replace the part 'pair-1' of pair.stl: import it with --name" in lines[3]
    lighter = importing("pair.stl", split=True, density=2700)
    assert "replaced the part of that name" in lighter.stdout


def test_an_unusual_size_or_weight_is_imported_with_a_warning(importing, tmp_path):
    box(tmp_path / "block.stl", 160, 80, 80)
    box(tmp_path / "inch.stl", 3, 2, 1)
    trimesh.Scene(trimesh.creation.box((3, 2, 1))).export(tmp_path / "small.3mf")
    done = importing("block.stl", "inch.stl", "small.3mf")
    assert done.code == 0
    warnings = done.stderr.splitlines()
    assert warnings[0].startswith("warning: block is 160 mm long; the usual size is 20 to 150 mm")
    assert warnings[1] == "warning: block weighs 8.04 kg, the arm carries 2.27 kg: is --density right?"
    assert "inch is 3 mm long" in warnings[2] and "(--unit in would make it 76.2 mm)" in warnings[2]
    # A 3MF states its unit, and another is refused.
    assert warnings[3] == ("warning: small is 3 mm long; the usual size is 20 to 150 mm: is the unit right?")


def fine_pin(file: Path, radius: float = 8.0, length: float = 60.0, sides: int = 1000) -> None:
    """A cylinder of 2,000,000 triangles, written as a binary STL."""
    rows, k = sides, np.arange(sides)
    turn, height = 2 * np.pi * k / sides, length * np.arange(rows) / (rows - 1)
    rim = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rings = np.concatenate([np.column_stack([rim, np.full(sides, z)]) for z in height])
    points = np.concatenate([rings, [[0, 0, 0], [0, 0, length]]])
    i, j = np.meshgrid(np.arange(rows - 1), k, indexing="ij")
    a, b = i * sides + j, i * sides + (j + 1) % sides
    c, d = a + sides, b + sides
    bottom, top, last = np.full(sides, rows * sides), np.full(sides, rows * sides + 1), (rows - 1) * sides
    corners = ((a, b, c), (b, d, c), (bottom, (k + 1) % sides, k), (top, last + k, last + (k + 1) % sides))
    faces = np.concatenate([np.stack(corner, axis=-1).reshape(-1, 3) for corner in corners])
    record = np.zeros(len(faces), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    record["v"] = points[faces]
    file.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + record.tobytes())


@pytest.mark.slow
def test_two_million_triangles_become_a_part_in_bounded_time_and_memory(tmp_path, own_cache):
    fine_pin(tmp_path / "pin.stl")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(
        [sys.executable, "-m", "mskgrasp.parts", "import", "pin.stl", "--density", "1000"],
        cwd=tmp_path, capture_output=True, text=True, env=os.environ | {"COLUMNS": "200"}, timeout=120,
    )  # fmt: skip
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == 0, done.stderr
    row = table(done.stdout)["pin.stl"]
    found = re.search(r"decimated from 2,000,000 to ([\d,]+) triangles, .* moved by at most ([\d.]+) mm", row)
    assert found and int(found[1].replace(",", "")) < 50_000 and 0 < float(found[2]) <= 0.05
    part = read_part(own_cache / "pin")
    mass = 1000 * np.pi * 0.008**2 * 0.06
    assert part.mass == pytest.approx(mass, rel=4e-3)
    across = mass * (3 * 0.008**2 + 0.06**2) / 12
    assert np.allclose(part.principal_inertia, [across, across, mass * 0.008**2 / 2], rtol=8e-3)
    assert used.ru_utime - before < 60 and used.ru_maxrss < 4 * 2**20  # kB


@pytest.mark.slow
def test_ctrl_c_leaves_whole_parts_only_and_lists_what_was_done(tmp_path, own_cache):
    box(tmp_path / "a.stl")
    for number in range(3):
        slow = trimesh.creation.torus(30, 10 - number, major_sections=64, minor_sections=48)
        slow.export(tmp_path / f"slow{number}.stl")
    process = subprocess.Popen(
        [sys.executable, "-m", "mskgrasp.parts", "import", "a.stl", "slow0.stl", "slow1.stl", "slow2.stl"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
    )
    limit = time.monotonic() + 60
    while not (own_cache / "a").exists() and time.monotonic() < limit:
        time.sleep(0.05)
    time.sleep(0.5)  # until the program has read the result
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 130 and "stopped by Ctrl-C" in stderr and "Traceback" not in stderr
    assert "a.stl" in table(stdout + "\n") or "a.stl" in stdout
    assert [read_part(path).name for path in sorted(own_cache.iterdir())][0] == "a"
