"""Assessment of a part from its CAD file to its report, in the simulated cell."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
import trimesh

from mskgrasp.assess.__main__ import main
from mskgrasp.assess.config import SIMULATIONS, AssessConfig
from mskgrasp.assess.config import TRIALS as TRIALS_OF_A_POLICY
from mskgrasp.assess.run import _sizes, _sources, begin_trials
from mskgrasp.assess.trials import CONDITIONS, EXACT, NOISY, PLANNERS, write_cells
from mskgrasp.core.errors import BadPart, MissingModel, UsageError
from mskgrasp.parts import find_part
from mskgrasp.planning.certified import FILE
from mskgrasp.runtime.run_folder import TRIALS, read_trials, rewrite_trials
from mskgrasp.simulation.hull_count import USUAL_HULLS
from mskgrasp.trials.placed_trial import PlacedTrial
from tests.assess.made_trials import made
from tests.browser import Page
from tests.planning.test_certified import certified, certified_grasp


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr("sys.argv", ["assess", *map(str, arguments)])
    return main()


@pytest.fixture
def cad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a bar, and its own cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "cad"
    folder.mkdir()
    trimesh.creation.box([70.0, 24.0, 18.0]).export(folder / "bar.stl")
    return folder


def test_a_bar_is_assessed_and_placed_within_a_millimetre(cad, tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    for condition in set(CONDITIONS) - {EXACT, NOISY}:
        monkeypatch.delitem(CONDITIONS, condition)
    arguments = (cad / "bar.stl", "--out", out, "--simulations", 36, "--trials", 1, "--workers", 1)
    assert run(monkeypatch, *arguments) == 0
    said = capsys.readouterr().out
    values = json.loads((out / "report.json").read_text())
    assert values["headline"] in said and values["headline"].startswith("With an exact camera: ")
    trials = read_trials(out / TRIALS, PlacedTrial.from_json)
    assert len(trials) == 2 * len(CONDITIONS)
    (own,) = (one for one in trials if one.condition == EXACT and one.planner == "certified")
    # A bar between parallel pads: nothing is easier.
    assert own.lifted and own.planned_by == "certified" and not own.wrong_pose
    error = own.error("predicted")
    assert error is not None and error[0] < 1e-3 and error[1] < 0.02
    stored = (out / TRIALS).read_bytes()
    assert run(monkeypatch, *arguments, "--tolerance", "5mm,5deg") == 0  # nothing is made again
    assert (out / TRIALS).read_bytes() == stored
    assert "5 mm and 5 degrees" in (out / "report.html").read_text()
    with pytest.raises(UsageError, match="seed differ"):
        run(monkeypatch, *arguments, "--seed", 1)
    trimesh.creation.box([60.0, 24.0, 18.0]).export(cad / "plate.stl")
    with pytest.raises(UsageError, match=r"other inputs \(part differ\); choose another --out"):
        run(monkeypatch, cad / "plate.stl", *arguments[1:])
    assert (out / TRIALS).read_bytes() == stored


@pytest.mark.slow
def test_a_block_too_wide_and_too_heavy_gets_a_report_that_says_so(cad, tmp_path, monkeypatch, capsys):
    trimesh.creation.box([120.0, 110.0, 100.0]).export(cad / "block.stl")
    out = tmp_path / "out"
    # By default 1200 are simulated, which takes minutes.
    assert run(monkeypatch, cad / "block.stl", "--out", out, "--trials", 1, "--workers", 1) == 0
    printed = capsys.readouterr()
    assert "block (10.4 kg) is too heavy for the arm: nothing is tried" in printed.err
    said = printed.out
    assert "block is wider than the hand in every resting pose: where fingers could hold it, " in said
    assert "its faces are 100 mm apart or more, and the hand opens 80 mm. None of" in said
    assert (
        "attempts could be made (too heavy for the arm (10.4 kg) " in said
        and "interval" not in said.split("\n\n")[-1]
    )
    with Page(out / "report.html") as page:
        line = page.evaluate("document.querySelector('.conclusion').textContent")
    assert line.startswith("block is wider than the hand in every resting pose")


def test_a_part_of_many_pieces_is_told_how_little_is_simulated(tmp_path, capsys):
    cell_file = write_cells(tmp_path)[EXACT]
    part = dataclasses.replace(find_part("hex_nut_m20"), n_hulls=2 * USUAL_HULLS)
    assert _sizes(part, AssessConfig(), cell_file) == (SIMULATIONS // 2, TRIALS_OF_A_POLICY // 2)
    assert "hex_nut_m20 has 96 convex pieces, whose contacts take long: about 600 simulations" in (
        capsys.readouterr().err
    )
    given = AssessConfig(simulations=300, trials=20)
    assert _sizes(part, given, cell_file) == (300, 20)
    assert _sizes(find_part("hex_nut_m20"), AssessConfig(), cell_file) == (SIMULATIONS, TRIALS_OF_A_POLICY)
    assert not capsys.readouterr().err


def test_trials_planned_by_other_certified_grasps_are_made_again(tmp_path, capsys):
    few, more = certified(certified_grasp(n=10, lifted=10)), certified(certified_grasp())
    begin_trials(tmp_path, few)
    lines = [made(number, planner=planner).to_json() for number in range(2) for planner in PLANNERS]
    rewrite_trials(tmp_path / TRIALS, lines)
    begin_trials(tmp_path, few)
    assert len(read_trials(tmp_path / TRIALS, PlacedTrial.from_json)) == 4
    begin_trials(tmp_path, more)
    assert [one.key for one in read_trials(tmp_path / TRIALS, PlacedTrial.from_json)] == [
        ("bracket", EXACT, 0, "networks"), ("bracket", EXACT, 1, "networks"),
    ]  # fmt: skip
    assert "2 trials are made again: 'hex_nut_m20' has other certified grasps" in capsys.readouterr().err
    assert (tmp_path / FILE).read_bytes() == more.contents()


def test_several_parts_that_cannot_be_assessed_end_with_1_and_an_index(cad, tmp_path, monkeypatch):
    for name in ("broken", "torn"):
        (cad / f"{name}.stl").write_bytes(b"solid nothing\n")
    assert run(monkeypatch, cad / "broken.stl", cad / "torn.stl", "--out", tmp_path / "out") == 1
    assert (tmp_path / "out" / "index.html").read_text().count("torn.stl") >= 1


def test_a_folder_gets_an_index_even_of_one_file(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "cad").mkdir()
    (tmp_path / "cad" / "torn.stl").write_bytes(b"solid nothing\n")
    assert run(monkeypatch, tmp_path / "cad", "--out", tmp_path / "out") == 1
    assert "torn.stl" in (tmp_path / "out" / "index.html").read_text()


def test_two_part_folders_of_one_name_are_refused(tmp_path):
    folder = find_part("hex_nut_m20").folder
    for name in ("one", "two"):
        shutil.copytree(folder, tmp_path / name)
    with pytest.raises(UsageError, match="one and .*two are both called 'hex_nut_m20'; rename one"):
        _sources(AssessConfig(parts=(str(tmp_path / "one"), str(tmp_path / "two"))))


def test_a_folder_of_results_in_this_directory_does_not_hide_the_part_of_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hex_nut_m20").mkdir()
    (tmp_path / "hex_nut_m20" / "report.html").touch()
    assert _sources(AssessConfig(parts=("hex_nut_m20",))) == ["hex_nut_m20"]


def test_a_file_that_is_named_twice_is_one_part(cad, monkeypatch):
    monkeypatch.chdir(cad)
    (cad / "plate.stl").touch()
    assert _sources(AssessConfig(parts=("plate.stl", "./plate.stl", str(cad / "plate.stl")))) == ["plate.stl"]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((), UsageError, "name a part"),
        (("no_such_part",), BadPart, "no part or part folder is called"),
        (("EMPTY",), UsageError, "holds no CAD file"),
        (("TWO",), UsageError, r"plate\.ply and .*plate\.stl are both called 'plate'; rename one"),
        (("CAD/broken.stl",), BadPart, "broken.stl"),
        (("hex_nut_m20", "--models", "nowhere"), MissingModel, "nowhere"),
        (("hex_nut_m20", "--out", "CAD"), UsageError, "holds other files"),
        (("CAD", "hex_nut_m20", "--unit", "in"), UsageError, "--unit is for a CAD file; hex_nut_m20 is none"),
    ],
)
def test_what_cannot_be_assessed_is_refused_in_a_line(arguments, error, message, cad, tmp_path, monkeypatch):
    for folder, names in (("empty", ()), ("two", ("plate.stl", "plate.ply", "zeta.stl"))):
        (tmp_path / folder).mkdir()
        for name in names:
            (tmp_path / folder / name).touch()
    (cad / "broken.stl").write_bytes(b"solid nothing\n")
    words = {"EMPTY": str(tmp_path / "empty"), "TWO": str(tmp_path / "two"), "CAD": str(cad)}
    filled = [words.get(one, one.replace("CAD/", f"{cad}/")) for one in arguments]
    with pytest.raises(error, match=message) as caught:
        run(monkeypatch, *filled, "--simulations", 24, "--trials", 1, "--workers", 1)
    assert "\n" not in str(caught.value)
