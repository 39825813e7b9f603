"""Log of every use of the test parts, and the commit that a figure was recorded with."""

from __future__ import annotations

import csv
import subprocess

from tests.docs.pages import ROOT

TEST_PARTS = ROOT / "docs" / "results" / "test_parts.csv"
"""Date, commit, command, split and figures, a line a use."""
_WRITTEN_BY_RECORDING = ("regression.json", "label_error.json")
"""What an earlier run of the same recording wrote is no change of the program."""


def commit() -> str:
    """Abbreviated commit, and whether the program has been changed since."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout

    changed = [
        line
        for line in git("status", "--porcelain").splitlines()
        if " docs/" not in line and not line.endswith(_WRITTEN_BY_RECORDING)
    ]
    return git("rev-parse", "--short", "HEAD").strip() + (" with local changes" if changed else "")


def log_use(date: str, recorded_by: str, command: str, split: str, figures: str) -> None:
    """Adds a line to the log."""
    with open(TEST_PARTS, "a", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow((date, recorded_by, command, split, figures))
