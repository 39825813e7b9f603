"""Command line of the dataset program."""

from __future__ import annotations

import pytest

from mskgrasp.dataset import list_shards
from mskgrasp.dataset.commands.command_line import main
from tests import synthetic
from tests.programs import run_here


@pytest.mark.parametrize(("form", "name"), [("npz", "data.npz"), ("maniskill", "data.h5")])
def test_nothing_is_overwritten(collected, tmp_path, form, name):
    (tmp_path / name).write_text("precious")
    done = run_here(main, "export", str(collected), "--format", form, "--out", str(tmp_path / name))
    assert done.returncode == 2 and "exists" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "precious"


def test_a_dataset_with_a_bad_shard_has_no_card_and_the_message_says_how_to_find_all(tmp_path):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=2, n_attempts=2, seed=0)
    list_shards(folder)[0].write_bytes(b"half a shard")
    done = run_here(main, "card", str(folder))
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert f"find all bad shards with: python -m mskgrasp.dataset check {folder}" in done.stderr


def test_the_result_of_an_export_is_named_with_the_number_of_attempts(tmp_path, capsys):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=2, n_attempts=3, seed=0)
    assert main(["export", str(folder), "--format", "npz", "--out", str(tmp_path / "x.npz")]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'x.npz'}: 6 attempts\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["chek"], "unknown command 'chek'; legal: check, card, export"),
        ([], "a command is missing; legal: check, card, export"),
        (["card", "nowhere"], "nowhere"),
        (
            ["export", "x", "--format", "csv", "--out", "y"],
            "--format: 'csv' is not legal; legal: npz, maniskill",
        ),
    ],
)
def test_a_wrong_command_is_one_line(arguments, message):
    done = run_here(main, *arguments)
    assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1
