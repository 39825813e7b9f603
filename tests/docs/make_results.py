"""Pages of results, rendered from stored reports.

    python -m tests.docs.make_results                   render the blocks of every page (`make results`)
    python -m tests.docs.make_results --record NAME..   run commands of docs/results/runs.yaml anew, store
                                                        their reports in docs/results/reports, then render

A page holds its own words and, between ``<!-- run: NAME -->`` and ``<!-- end -->``, what is rendered.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from mskgrasp.core.config import read_yaml
from mskgrasp.core.settings import Physics
from mskgrasp.evaluate.comparison import DisplacementSummary
from mskgrasp.evaluate.report import Report
from mskgrasp.evaluate.report import sections as evaluation_sections
from mskgrasp.evaluate.summary import SuccessSummary
from mskgrasp.palletize.report import result_section
from mskgrasp.palletize.summary import PlacementSummary
from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import Table, cell_text
from mskgrasp.validate.engines import sections as engine_sections
from mskgrasp.validate.tables import sections as validation_sections
from tests.docs.pages import ROOT

RESULTS = ROOT / "docs" / "results"
RUNS = RESULTS / "runs.yaml"
REPORTS = RESULTS / "reports"
FACTS = ("command", "split", "n", "intervals", "model", "simulation", "recorded", "machine")
"""Rows of the table above the figures of a run."""
_BLOCK = re.compile(r"(<!-- run: ([a-z0-9_]+) -->\n).*?(<!-- end -->)", re.S)


def rendered(page: str) -> str:
    """A page with the blocks that the stored reports give."""
    return _BLOCK.sub(lambda found: found[1] + block(found[2]) + found[3], page)


def block(name: str) -> str:
    """The table of facts and the tables of figures of a stored run, as Markdown."""
    stored = json.loads((REPORTS / f"{name}.json").read_text(encoding="utf-8"))
    facts = read_yaml(RUNS)[name] | stored["record"]
    lines = ["", "| | |", "|---|---|", *(f"| {fact} | {_fact(fact, facts[fact])} |" for fact in FACTS), ""]
    shown = [one for one in _sections(stored["report"]) if not one.page_only and (one.text or one.tables)]
    for section in shown:
        if len(shown) > 1:
            lines += [f"### {section.title}", ""]
        for paragraph in section.text:
            lines += [paragraph, ""]
        for table in section.tables:
            lines += [*_markdown(table), ""]
    return "\n".join(lines) + "\n"


def _fact(name: str, value: str) -> str:
    return f"`{value}`" if name == "command" else value


def _sections(report: dict[str, Any]) -> list[Section]:
    if "engines" in report:
        return engine_sections(report)
    if "closed_form" in report:
        return validation_sections(report)
    if "experiment" in report:
        kind = SuccessSummary if report["experiment"] == "success" else DisplacementSummary
        summary = TypeAdapter(kind).validate_python(report)
        whole = Report(summary=summary, trials={}, worst={}, settings={}, versions={})
        return evaluation_sections(whole, Path())
    return [result_section(TypeAdapter(PlacementSummary).validate_python(report))]


def _markdown(table: Table) -> Iterator[str]:
    if table.caption:
        yield from (table.caption, "")
    yield "| " + " | ".join(table.header) + " |"
    yield "|" + "".join("--:|" if kind == "number" else "---|" for kind in table.kinds())
    for row in table.rows:
        yield "| " + " | ".join(cell_text(cell).replace("|", "\\|") or " " for cell in row) + " |"


def record(name: str) -> None:
    """Runs a command and stores its report with commit, date and machine.

    Raises:
        CalledProcessError: The command failed.
    """
    facts = read_yaml(RUNS)[name]
    out = ROOT / "out" / "results" / name
    command = [sys.executable, *shlex.split(facts["command"])[1:], "--out", str(out)]
    subprocess.run(command, cwd=ROOT, check=not facts.get("may_fail"))
    text = (out / facts.get("report", "report.json")).read_text(encoding="utf-8")
    report = json.loads(text.replace(f"{ROOT}/", ""))
    for setting in ("out", "workers"):  # of the machine, not of the measurement
        report.get("settings", {}).pop(setting, None)
    physics = Physics()
    values = dict(
        record=dict(
            n=_size(report),
            simulation=f"{physics.rate_hz} Hz, {physics.position_iterations} iterations",
            recorded=f"commit {_commit()}, {datetime.date.today().isoformat()}",
            machine=_machine(),
        ),
        report=report,
    )
    REPORTS.mkdir(exist_ok=True)
    (REPORTS / f"{name}.json").write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def _size(report: dict[str, Any]) -> str:
    if "engines" in report:
        settings = report["settings"]
        grasps = settings["grasps_per_part"]
        return f"{grasps} grasps of each of {len(report['engines']) - 3} parts; seed {settings['seed']}"
    if "closed_form" in report:
        settings = report["settings"]
        most = settings["grasps_per_part"]
        references = "; ".join(
            f"{min(most, one['grasps_per_part'])} under {one['rate_hz']} Hz "
            f"with {one['position_iterations']} iterations"
            for one in settings["references"]
        )
        return (
            f"{len(report['parts'])} parts; grasps a part: {settings['grasps_per_part']} in production, "
            f"{references}, {min(most, settings['variant_grasps_per_part'])} a variant; "
            f"seed {settings['seed']}"
        )
    if "experiment" in report:
        settings = report["settings"]
        n_trials = len(report["trials"])
        return f"{n_trials} trials, {settings['trials']} a part and policy, seed {settings['seed']}"
    tried = sum(row["tried"] for row in report["corrections"].values())
    return f"{tried} placements of {len(report['parts'])} parts; the same grasps for all corrections"


def _commit() -> str:
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout

    changed = [line for line in git("status", "--porcelain").splitlines() if " docs/" not in line]
    return git("rev-parse", "--short", "HEAD").strip() + (" with local changes" if changed else "")


def _machine() -> str:
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"model name\s*: (.*)", text)
    name = re.sub(r"\((R|TM)\)|\bProcessor\b|@.*|\d+-Core", "", model[1]) if model else "unknown processor"
    vectors = "with" if "avx512f" in text else "without"
    return f"{os.cpu_count()} cores of {' '.join(name.split())} {vectors} AVX-512, no GPU used"


def main() -> int:
    """Records what is asked for, and renders every page."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.docs.make_results",
        description="Render the pages of results from stored reports.",
    )
    parser.add_argument(
        "--record", nargs="+", default=[], choices=sorted(read_yaml(RUNS)), metavar="NAME",
        help="runs of docs/results/runs.yaml to make anew first",
    )  # fmt: skip
    for name in parser.parse_args().record:
        record(name)
    for path in sorted(RESULTS.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        after = rendered(before)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(f"wrote {path.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
