"""Stored reports of results, and the facts that each table states of its run."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from mskgrasp.core.config import read_yaml
from tests.docs.pages import ROOT
from tests.sim_in_the_loop.regression import shipped_weights

RESULTS = ROOT / "docs" / "results"
RUNS = RESULTS / "runs.yaml"
REPORTS = RESULTS / "reports"
_SHIPPED = "shipped ([card](../../mskgrasp/learning/pretrained/card.md))"
"""In the fact ``model``, the model that ships."""


@dataclass(frozen=True, kw_only=True)
class StoredReport:
    """A stored report.

    Attributes:
        name: Of its file and of its block on a page.
        facts: Command, split, n, intervals, model, simulation, commit, machine, as Markdown; perhaps notes,
            and ``weights``, by which a model that has shipped is known.
        report: What the command wrote; the path of a table in the repository where that holds it.
    """

    name: str
    facts: dict[str, Any]
    report: dict[str, Any] | str

    @property
    def of_former_model(self) -> bool:
        """Whether it was made with weights that shipped before those that ship now."""
        return self.facts.get("weights", shipped_weights()) != shipped_weights()


def known_runs() -> dict[str, Any]:
    """The runs of runs.yaml, not to be changed."""
    return _runs_of(RUNS.stat().st_mtime_ns)


@lru_cache(maxsize=1)
def _runs_of(_changed_ns: int) -> dict[str, Any]:
    """Parses runs.yaml once for every state of it, as that takes a tenth of a second."""
    return read_yaml(RUNS)


def read_stored(name: str) -> StoredReport:
    """Reads a stored report, following a reference to another JSON file of the repository."""
    values = json.loads((REPORTS / f"{name}.json").read_text(encoding="utf-8"))
    run = known_runs().get(name)
    known = run | dict(command=f"`{run['command']}`") if run else {}
    report = values["report"]
    if isinstance(report, str) and report.endswith(".json"):
        report = json.loads((ROOT / report).read_text(encoding="utf-8"))
    stored = StoredReport(name=name, facts=known | values["record"], report=report)
    if not stored.of_former_model:
        return stored
    former = f"shipped before (weights `{stored.facts['weights']}`)"
    model = stored.facts["model"].replace(_SHIPPED, former)
    return replace(stored, facts=stored.facts | {"model": model})


def page_of(name: str) -> str:
    """Path from the root of the repository of the page that shows a report."""
    for page in sorted(RESULTS.glob("*.md")):
        if f"<!-- run: {name} -->" in page.read_text(encoding="utf-8"):
            return page.relative_to(ROOT).as_posix()
    raise ValueError(f"no page of {RESULTS} shows the report '{name}': add <!-- run: {name} --> to one")
