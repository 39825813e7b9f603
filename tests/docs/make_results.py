"""Results pages made from stored reports of programs.

python -m tests.docs.make_results                                      write the pages anew
python -m tests.docs.make_results --store out/validate/validate.json   take this report, then write them
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from mskgrasp.runtime.console_table import Table, cell_text
from mskgrasp.validate.tables import sections
from tests.docs.pages import ROOT

REPORT = ROOT / "docs" / "results" / "reports" / "validation.json"
PAGE = ROOT / "docs" / "results" / "validation.md"
README = ROOT / "README.md"
DEFAULTS = ROOT / "configs" / "validate" / "default.yaml"

INTRODUCTION = """\
# Results: validation of the simulated labels

Made by `make results` from [the stored report](reports/validation.json); do not edit.
[Validation](../validation.md) says what is measured and how the tests work. Shift and turn are differences of
displacements, grasp by grasp, over grasps that succeed under both settings.

"""

NOTES = {
    "Closed-form physics": """\
The pads hold a point with the moment of the patch radius itself, and a flat contact with that of its two
farthest corners: more than uniform pressure on the same contact would hold, by the factor in the table. No
patch radius changes the latter.""",
    "Errors by origin": """\
*Beyond the floor* is the median distance less that of the reference's floor, *success* the difference of
success rates, each with its 90 % interval. A floor is a setting against itself with its starts moved.""",
    "Sensitivity: differences to production": """\
Each row is production with one thing changed. Where hulls are varied, only parts are compared whose hulls
that changes.""",
}


def report() -> dict[str, Any]:
    """The stored report of `mskgrasp.validate`."""
    return json.loads(REPORT.read_text(encoding="utf-8"))


def page(record: dict[str, Any]) -> str:
    """The page on validation."""
    found = [INTRODUCTION + _head(record)]
    for section in sections(record):
        found.append(f"## {section.title}\n")
        notes = [NOTES[section.title]] if section.title in NOTES else []
        found += [f"{text}\n" for text in (*notes, *section.text)]
        found += [_markdown(table) for table in section.tables]
    return "\n".join(found)


def with_row(readme: str, record: dict[str, Any]) -> str:
    """The README with the row of the validation."""
    return re.sub(r"^\| labels .*\| `mskgrasp.validate` \|$", lambda _: _row(record), readme, flags=re.M)


def _row(record: dict[str, Any]) -> str:
    own = next(one for one in record["grid"] if one["setting"] == record["production"])
    floor = record["errors"][0]
    said = (
        f"labels against {record['yardstick']}: success agrees in {own['agreement']:.1%}, displacement "
        f"differs by {1e3 * own['shift_median']:.3f} mm (median); floor of the comparison: "
        f"{floor['agreement']:.1%}, {1e3 * floor['shift_median']:.3f} mm"
    )
    n = f"{own['n']} grasps of {len(record['parts'])} parts, no model"
    return f"| {said} | {n} | none | `mskgrasp.validate` |"


def _head(record: dict[str, Any]) -> str:
    settings, recorded = record["settings"], record["recorded"]
    usual = yaml.safe_load(DEFAULTS.read_text(encoding="utf-8"))
    options = ""
    if list(settings["parts"]) != usual["parts"]:
        options += f" --parts {' '.join(settings['parts'])}"
    if settings["grasps_per_part"] != usual["grasps_per_part"]:
        options += f" --grasps-per-part {settings['grasps_per_part']}"
    physics, most = settings["physics"], settings["grasps_per_part"]
    counts = ", ".join(
        f"{min(most, one['grasps_per_part'])} under {one['rate_hz']} Hz, {one['position_iterations']} it "
        f"({min(most, one['floor_grasps_per_part'])} at its floor)"
        for one in settings["references"]
    )
    variants = min(most, settings["variant_grasps_per_part"])
    rows = {
        "command": f"`python -m mskgrasp.validate{options}`",
        "split": f"{len(record['parts'])} parts: {', '.join(settings['parts'])}",
        "n": f"grasps of each part: {most} under production, {counts}, {variants} under each variant",
        "intervals": "90 %; medians: bootstrap over parts; success: Student's, parts as clusters",
        "model": "none",
        "simulation": (
            f"production: {record['production']}, heavy parts lifted at {physics['coarse_rate_hz']} Hz, "
            "motion through air skipped; references: nothing skipped, nothing coarse"
        ),
        "recorded": f"commit {recorded['commit']}, {recorded['date']}",
        "machine": recorded["machine"],
    }
    return _markdown(Table(header=("", ""), rows=list(rows.items())))


def _markdown(table: Table) -> str:
    lines = [_line(table.header), "|" + "---|" * len(table.header)]
    return "\n".join([*lines, *(_line([cell_text(cell) for cell in row]) for row in table.rows)]) + "\n"


def _line(cells: Sequence[str]) -> str:
    escaped = [cell.replace("|", "\\|") for cell in cells]
    return "| " + " | ".join(escaped) + " |" if any(escaped) else "|" + " |" * len(escaped)


def store(path: Path, machine: str) -> None:
    """Takes over a report of `mskgrasp.validate`, with commit, date and machine."""
    record = json.loads(path.read_text(encoding="utf-8"))
    if "grid" not in record:
        raise SystemExit(f"{path} holds no comparisons: run mskgrasp.validate without --no-convergence")
    for name in ("out", "workers"):  # of the machine, not of the measurement
        record["settings"].pop(name, None)
    commit = ["git", "rev-parse", "--short=7", "HEAD"]
    found = subprocess.run(commit, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    written = datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()
    record["recorded"] = {"commit": found, "date": written, "machine": machine}
    REPORT.parent.mkdir(exist_ok=True)
    REPORT.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _machine() -> str:
    try:
        model = re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(), flags=re.M)
    except OSError:
        model = None
    return f"{os.cpu_count()} cores of {model[1] if model else 'a processor without a name'}"


def main() -> None:
    """Stores a report if one is given, then writes the page and the README's row."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--store", type=Path, help="a validate.json that takes the stored one's place")
    parser.add_argument("--machine", default=_machine(), help="for the page's head")
    options = parser.parse_args()
    if options.store:
        store(options.store, options.machine)
    record = report()
    PAGE.write_text(page(record), encoding="utf-8")
    README.write_text(with_row(README.read_text(encoding="utf-8"), record), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)} and the row of {README.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
