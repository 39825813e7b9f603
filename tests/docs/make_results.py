"""Pages of results, rendered from stored reports.

    python -m tests.docs.make_results                   render the blocks of every page and the summaries of
                                                        README and index (`make results`)
    python -m tests.docs.make_results --record NAME..   run commands of docs/results/runs.yaml anew, store
                                                        their reports in docs/results/reports, then render

A page holds its own words, without figures, and, between ``<!-- run: NAME -->`` and ``<!-- end -->``, what is
rendered from ``reports/NAME.json``:

    record   rows of the table above the figures, for a run of runs.yaml those that its entry lacks; notes
    report   what the command wrote, or the path of a file in the repository that holds it

Reports of evaluate, palletize, benchmark and validate are shown as their programs show them. Any other report
has ``tables``, each with a header, rows and perhaps a title; tests.benchmarks write theirs with ``--out``. A
run that is recorded for the first time needs its entry in runs.yaml, and its block on a page.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from mskgrasp.benchmark.report import stored_sections
from mskgrasp.core.settings import Physics
from mskgrasp.dataset.label_error import STORED as LABEL_ERROR
from mskgrasp.dataset.label_error import LabelError
from mskgrasp.evaluate.comparison import DisplacementSummary
from mskgrasp.evaluate.report import Report, report_sections
from mskgrasp.evaluate.summary import SuccessSummary
from mskgrasp.learning.label_source import LabelSource, source_text
from mskgrasp.learning.model_card import result_rows
from mskgrasp.palletize.report import result_section
from mskgrasp.palletize.summary import PlacementSummary
from mskgrasp.parts.commands.rate import Rate
from mskgrasp.parts.names import SPLITS
from mskgrasp.parts.versions import PART_VERSION
from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import Table
from mskgrasp.simulation.versions import SIMULATION_VERSION
from mskgrasp.validate.engines import engine_sections
from mskgrasp.validate.tables import label_error_section, validation_sections
from tests.benchmarks.report import markdown_rows
from tests.docs.pages import ROOT
from tests.docs.stored_reports import REPORTS, RESULTS, known_runs, page_of, read_stored
from tests.docs.summary_rows import rows_of
from tests.docs.summary_table import INDEX, README, with_summary
from tests.docs.uses_of_test_parts import commit, log_use
from tests.sim_in_the_loop.regression import Row, shipped_weights, stored_figures

FACTS = ("command", "split", "n", "intervals", "model", "simulation", "recorded", "machine")
"""Rows of the table above the figures of a run."""
MODEL_SIDES = {"test": "Parts of unknown families", "new_sizes": "Other sizes of known families"}
"""Held-out parts by which a model is described, and their heading."""
_BLOCK = re.compile(r"(<!-- run: ([a-z0-9_]+) -->\n).*?(<!-- end -->)", re.S)


def rendered(page: str) -> str:
    """A page with the blocks that the stored reports give."""
    return _BLOCK.sub(lambda found: found[1] + block(found[2]) + found[3], page)


def block(name: str) -> str:
    """The table of facts, the tables of figures and the notes of a stored run, as Markdown."""
    stored = read_stored(name)
    facts = stored.facts
    lines = ["", "| | |", "|---|---|", *(f"| {fact} | {facts[fact]} |" for fact in FACTS), ""]
    shown = [one for one in _sections(stored.report) if not one.page_only and (one.text or one.tables)]
    for section in shown:
        if section.title and len(shown) > 1:
            lines += [f"### {section.title}", ""]
        for paragraph in section.text:
            lines += [paragraph, ""]
        for table in section.tables:
            lines += [*([table.caption, ""] if table.caption else []), *markdown_rows(table), ""]
    for note in facts.get("notes", []):
        lines += [note, ""]
    return "\n".join(lines) + "\n"


def _sections(report: dict[str, Any] | str) -> list[Section]:
    """What is shown of a report, or of the file of the repository that holds it."""
    if isinstance(report, str):
        return [Section(title="", tables=[_rating(ROOT / report)])]
    if "tables" in report:
        return [
            Section(title=one.get("title", ""), tables=[Table(header=one["header"], rows=one["rows"])])
            for one in report["tables"]
        ]
    if "metrics" in report:
        return [
            Section(title=title, tables=[Table(header=head, rows=rows) for head, *rows in result_rows(side)])
            for name, title in MODEL_SIDES.items()
            if (side := report["metrics"].get(name))
        ]
    if "weights" in report:
        return [Section(title="", tables=[stored_figures([Row(**row) for row in report["rows"]])])]
    if "engines" in report:
        return engine_sections(report)
    if "closed_form" in report:
        return validation_sections(report)
    if "label_error" in report:
        return [label_error_section(report)]
    if "budgets" in report:
        return stored_sections(report)
    if "experiment" in report:
        kind = SuccessSummary if report["experiment"] == "success" else DisplacementSummary
        summary = TypeAdapter(kind).validate_python(report)
        whole = Report(summary=summary, trials={}, worst={}, settings={}, versions={})
        return report_sections(whole, Path())
    return [result_section(TypeAdapter(PlacementSummary).validate_python(report))]


def _rating(path: Path) -> Table:
    """Parts of the catalogue by their success in random grasps."""
    with open(path, encoding="utf-8", newline="") as file:
        rated = [part for part in csv.DictReader(file) if part["attempts"]]
    inside = [one for one in rated if Rate.low <= int(one["successes"]) / int(one["attempts"]) <= Rate.high]
    groups = {"all": rated, f"{Rate.low:.0%} to {Rate.high:.0%} of grasps succeed": inside}
    groups |= {f"of these, {side}": [one for one in inside if one["split"] == side] for side in SPLITS}
    rows = [(name, len(parts), sum(int(one["attempts"]) for one in parts)) for name, parts in groups.items()]
    return Table(header=("rated parts", "parts", "attempts"), rows=rows)


def record(name: str) -> None:
    """Runs a command and stores its report with commit, date and machine.

    A command that keeps its report in the repository itself (``stored`` in runs.yaml) is referred to.

    Raises:
        CalledProcessError: The command failed.
    """
    facts = known_runs()[name]
    recorded = f"commit {commit()}, {datetime.date.today().isoformat()}"
    out = ROOT / facts.get("out", f"out/results/{name}")
    if "out" not in facts:  # a folder of its own checks what it holds
        shutil.rmtree(out, ignore_errors=True)  # results of an earlier state of the code must not count
    command = [sys.executable, *shlex.split(facts["command"])[1:], "--out", str(out)]
    subprocess.run(command, cwd=ROOT, check=not facts.get("may_fail"))
    path = ROOT / facts["stored"] if "stored" in facts else out / facts.get("report", "report.json")
    report = json.loads(path.read_text(encoding="utf-8").replace(f"{ROOT}/", ""))
    for setting in ("out", "workers"):  # of the machine, not of the measurement
        report.get("settings", {}).pop(setting, None)
    physics = Physics()
    values = dict(
        record=dict(
            n=facts.get("n") or _size(report),
            simulation=facts.get("simulation")
            or _labels(report)
            or (
                f"{physics.rate_hz} Hz, {physics.position_iterations} iterations; simulation version "
                f"{SIMULATION_VERSION}, parts of version {PART_VERSION}"
            ),
            recorded=recorded,
            machine=facts.get("machine") or _machine(),
        ),
        report=facts.get("stored", report),
    )
    if "shipped" in facts.get("model", ""):
        values["record"]["weights"] = shipped_weights()
    if "training" in report:
        counts = report["training"]
        values["record"]["model"] = (
            f"shipped: trained on {counts['attempts']} attempts at {len(counts['training_parts'])} parts, "
            f"early stopping and calibration on {len(counts['validation_parts'])} validation parts"
        )
    if name == "label_error":  # a dataset's card states it, too
        known = report["label_error"] | {"simulation": report["versions"]["simulation"]}
        stored = {field.name: known[field.name] for field in fields(LabelError)}
        LABEL_ERROR.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
        values["report"] = {key: report[key] for key in ("settings", "versions", "label_error")}
    if "experiment" in report:  # a sentence a trial, which the run's folder has and no page shows
        report.pop("trials")
    REPORTS.mkdir(exist_ok=True)
    (REPORTS / f"{name}.json").write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def log_test_parts(name: str) -> None:
    """Adds a line to the log of the uses of test parts, if the stored run used them and has added none."""
    stored = read_stored(name)
    logged = isinstance(stored.report, dict) and "test_parts_logged" in stored.report
    if logged or not stored.facts["split"].startswith("test"):
        return
    recorded_by, _, date = stored.facts["recorded"].removeprefix("commit ").partition(", ")
    figures = "; ".join(row.text for row in rows_of(stored))
    log_use(date, recorded_by, stored.facts["command"].strip("`"), stored.facts["split"], figures)


def _labels(report: dict[str, Any]) -> str:
    """The simulation of the labels that a dataset or a model is made of; empty for other reports."""
    labels = report.get("labels", "")
    if isinstance(labels, str):
        return labels
    return "labels of " + "; ".join(source_text(LabelSource(**one)) for one in labels)


def _size(report: dict[str, Any]) -> str:
    if "n" in report:
        return report["n"]
    if "metrics" in report:
        test = report["metrics"]["test"]
        return f"{test['gqn']['n']} grasps, {test['gdn']['n']} of them successes"
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
    if "budgets" in report:
        attempts = sum(row["lifted"]["of"] for row in report["rows"])
        return f"{attempts} attempts at {len(report['parts'])} parts, seed {report['seed']}"
    if "experiment" in report:
        settings = report["settings"]
        count = len(report.get("families", []))
        families = f" of {count} families" if count > 1 else ""
        return (
            f"{len(report['trials'])} trials, {settings['trials']} a part and policy; "
            f"{len(settings['parts'])} parts{families}, seed {settings['seed']}"
        )
    if "weights" in report:
        return f"{len(report['rows'])} grasps of {len({row['part'] for row in report['rows']})} parts"
    tried = sum(row["tried"] for row in report["corrections"].values())
    return f"{tried} placements of {len(report['parts'])} parts; the same grasps for all corrections"


def _machine() -> str:
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"model name\s*: (.*)", text)
    name = re.sub(r"\((R|TM)\)|\bProcessor\b|@.*|\d+-Core", "", model[1]) if model else "unknown processor"
    vectors = "with" if "avx512f" in text else "without"
    return f"{os.cpu_count()} cores of {' '.join(name.split())} {vectors} AVX-512, no GPU used"


def main() -> int:
    """Records what is asked for, and renders every page, the index and the README."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.docs.make_results",
        description="Render the pages of results from stored reports.",
    )
    parser.add_argument(
        "--record", nargs="+", default=[], choices=sorted(known_runs()), metavar="NAME",
        help="runs of docs/results/runs.yaml to make anew first",
    )  # fmt: skip
    names = parser.parse_args().record
    for name in names:  # first of all: a run may take hours
        try:
            page_of(name)
        except ValueError as error:
            parser.error(str(error))
    for name in names:
        record(name)
        log_test_parts(name)
    for path in (*sorted(RESULTS.glob("*.md")), README):
        before = path.read_text(encoding="utf-8")
        after = with_summary(before, path) if path in (INDEX, README) else rendered(before)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(f"wrote {path.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
