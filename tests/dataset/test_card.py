from __future__ import annotations

import json
import re

import numpy as np
import pytest

from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.dataset.card import Card, Family, read_card, tables
from mskgrasp.dataset.commands.command_line import main
from tests import synthetic


def test_the_card_counts_what_the_shards_hold(collected):
    card = read_card(collected)
    shards = [read_shard(path) for path in list_shards(collected)]
    success = np.concatenate([attempts.success for attempts, _ in shards])
    assert (card.attempts, card.successes) == (len(success), int(success.sum()))
    assert card.shards == 4 and card.parts == 2 and card.seed == 5
    assert sum(card.failures.values()) == card.attempts - card.successes
    assert card.discarded == {} and card.planner == ""
    assert card.size == sum(path.stat().st_size for path in list_shards(collected))
    assert card.versions[0][0]["sapien"] and card.versions[0][1] == 4
    rows = json.loads((collected / "summary.json").read_text())["parts"]
    for family, counts in card.families.items():
        own = [row for row in rows if row["family"] == family]
        assert sorted(counts.tried) == sorted(row["attempts"] for row in own)
        assert sorted(counts.won) == sorted(row["successes"] for row in own)


def test_intervals_are_by_parts_at_which_attempts_are_alike():
    facts = dict(tables(card_of(won=(40, 0, 40, 0), tried=(40, 40, 40, 40)))[0][2])
    assert facts["success"].startswith("50.0% (") and facts["scenes drawn again"].startswith("7, ")
    assert facts["grasps"] == "chosen by the planner of model 0123"
    low, high = re.findall(r"([\d.]+)%", facts["success"])[1:]
    # Jeffreys's interval of two of four parts is 12 to 88 %; by attempts it would be 42.3 to 57.7 %.
    assert (float(low), float(high)) == pytest.approx((12, 88), abs=2)


def card_of(won: tuple[int, ...], tried: tuple[int, ...]) -> Card:
    return Card(
        name="made", shards=4, parts=len(won), families={"nut": Family(won=won, tried=tried)}, failures={},
        discarded={}, redrawn=7, displacement=None, turn=None, image=(2, 2), seed=0, planner="0123",
        physics={}, noise={}, versions=[], size=1,
    )  # fmt: skip


def test_displacements_are_those_of_successes(tmp_path):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=3, n_attempts=30, seed=2)
    moved = np.concatenate(
        [a.displacement[a.success] for a, _ in (read_shard(path) for path in list_shards(folder))]
    )
    card = read_card(folder)
    assert card.displacement is not None and card.turn is not None
    assert np.isclose(card.displacement[0], np.median(np.linalg.norm(moved[:, :3], axis=1)))
    assert np.isclose(card.turn[1], np.quantile(np.abs(moved[:, 3]), 0.9))
    assert card.discarded == {"unsettled": 3}


def test_the_printed_card_has_every_block(collected, capsys):
    assert main(["card", str(collected)]) == 0
    printed = capsys.readouterr().out
    for word in ("12", "4 shards", "hex_nut", "Failures", "Discarded", "rate_hz", "sapien 3."):
        assert word in printed


def test_the_written_card_is_well_formed(collected, tmp_path, capsys):
    assert main(["card", str(collected), "--out", str(tmp_path / "card")]) == 0
    assert "card.md, report.json" in capsys.readouterr().out
    page = (tmp_path / "card" / "card.md").read_text()
    assert page.startswith("# Dataset data\n")
    blocks = re.findall(r"(?:^\|.*\n)+", page, flags=re.MULTILINE)
    assert len(blocks) == 7
    for block in blocks:
        lines = block.splitlines()
        assert set(lines[1]) <= {"|", "-"}
        assert len({line.count("|") for line in lines}) == 1
    assert "| attempts | 12 |" in page
    report = json.loads((tmp_path / "card" / "report.json").read_text())
    assert report["n"] == "12 attempts at 2 parts, seed 5" and "Hz" in report["labels"]
    assert ["attempts", "12"] in report["tables"][0]["rows"] and len(report["tables"]) == 7
