"""State of runs that take hours, kept in the repository: a run stopped on one machine goes on on another.

    python -m tests.docs.kept_runs keep NAME..      store settings and trials of runs, without frames
    python -m tests.docs.kept_runs restore NAME..   write them into the runs' folders, which must not exist

What is kept of a run is compressed JSON of the texts of `FILES`, in docs/results/runs/NAME.json.xz.
"""

from __future__ import annotations

import argparse
import json
import lzma
from pathlib import Path

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import read_bounded, write_whole
from mskgrasp.runtime import cli
from mskgrasp.runtime.run_folder import INPUTS, SETTINGS, TRIALS
from tests.docs.pages import ROOT
from tests.docs.stored_reports import RESULTS, known_runs

KEPT = RESULTS / "runs"
FILES = (TRIALS, INPUTS, "cell.yaml", SETTINGS)
"""Files of a run's folder; the last one says that the run has begun."""
_MOST_BYTES, _MOST_TEXT = 2**26, 2**30


def keep(out: Path, path: Path) -> int:
    """Store the state of a run; return the number of its whole lines.

    Raises:
        UsageError: There is no run.
    """
    texts = {name: (out / name).read_text(encoding="utf-8") for name in FILES if (out / name).is_file()}
    if SETTINGS not in texts or INPUTS not in texts:
        raise UsageError(f"no run in {out}: there is no {SETTINGS} and {INPUTS}")
    trials = texts.get(TRIALS, "")
    texts[TRIALS] = trials[: trials.rfind("\n") + 1]  # the last line may be being written
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lzma.compress(json.dumps(texts).encode()))
    return texts[TRIALS].count("\n")


def restore(path: Path, out: Path) -> int:
    """Write the stored state of a run into a new folder; return the number of its trials.

    Raises:
        UsageError: Nothing is stored, or the folder exists.
        BadDataset: The file is damaged.
    """
    if not path.is_file():
        raise UsageError(f"no {path}: keep the run first")
    if out.exists():
        raise UsageError(f"{out} exists; move it away to restore the stored run")
    decompressor = lzma.LZMADecompressor()
    try:
        content = decompressor.decompress(read_bounded(path, _MOST_BYTES), max_length=_MOST_TEXT)
        texts = json.loads(content)
        if not decompressor.eof or not set(texts) <= set(FILES):
            raise ValueError
        texts = {name: texts[name].encode() for name in FILES if name in texts}
    except (lzma.LZMAError, ValueError, TypeError, AttributeError) as error:
        raise BadDataset(f"{path} is not the state of a run; keep the run again") from error
    out.mkdir(parents=True)
    for name, text in texts.items():
        write_whole(out / name, text)
    return texts.get(TRIALS, b"").count(b"\n")


def main() -> int:
    """Store or restore."""
    runs = {name: run["out"] for name, run in known_runs().items() if "out" in run}
    parser = argparse.ArgumentParser(prog="python -m tests.docs.kept_runs", description="Keep long runs.")
    parser.add_argument("what", choices=("keep", "restore"))
    parser.add_argument("names", nargs="+", choices=sorted(runs), metavar="NAME", help="runs of runs.yaml")
    options = parser.parse_args()
    for name in options.names:
        path, out = KEPT / f"{name}.json.xz", ROOT / runs[name]
        n = keep(out, path) if options.what == "keep" else restore(path, out)
        print(f"{name}: {n} trials, {path.stat().st_size / 2**20:.1f} MB")
    return 0


if __name__ == "__main__":
    cli.run("kept_runs", main)
