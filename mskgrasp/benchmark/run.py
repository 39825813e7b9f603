"""Benchmark: parts, trials of every planner, report."""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from mskgrasp.benchmark.config import QUICK_PARTS, BenchmarkConfig
from mskgrasp.benchmark.part_list import BenchmarkPart, benchmark_parts
from mskgrasp.benchmark.planners import PlannerSettings, check_planners, package_digests
from mskgrasp.benchmark.report import RunFacts, write_report
from mskgrasp.benchmark.trials import BenchmarkSetup, scene_tasks, trial_bench
from mskgrasp.core.errors import UsageError
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.parts.builtin import builtin_names, recipe_of
from mskgrasp.parts.catalogue import read_index
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.run_inputs import BY_CONTENT, keep_certified, model_digests, part_digests
from mskgrasp.reports.console import print_sections
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.run_folder import file_digest, opened_run
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.certify_parts import certify_missing
from mskgrasp.trials.cell_file import CellFile, read_cell
from mskgrasp.trials.placed_scenes import placed_trials
from mskgrasp.trials.placed_trial import PlacedTrial

SCENE_VERSION = 10
"""Raised by every change after which a seed makes other trials."""
_MAY_CHANGE = (
    "planners",
    "parts",
    "n_parts",
    "trials",
    "quick",
    "workers",
    "out",
    "paper_models",
    "program",
    "grasps",
    "part",
    "grasps_origin",
    *BY_CONTENT,
)


def benchmark(config: BenchmarkConfig) -> None:
    """Compare planners on parts, and write the report.

    Raises:
        UsageError: A planner cannot run, the cell is not simulated, or the folder holds another run.
        MskgraspError: A part, a model or a planner cannot be used.
    """
    config = config.model_copy(update={"out": config.folder})  # recorded as it is used
    check_planners(config)
    if not config.cell_file.is_file():
        raise UsageError(f"--cell is {config.cell!r}; legal: sapien, mujoco, or a cell's YAML file")
    cell = read_cell(config.cell_file, noise=config.noise, measure="truth", tape=None)
    if not cell.simulated:
        raise UsageError(
            f"--cell {config.cell} is not simulated; the benchmark needs a feeder and a tracker: use sapien "
            "or mujoco"
        )
    training = {"": load_models(config.models).meta.training}
    if config.paper_models is not None:
        training["paper"] = load_models(config.paper_models).meta.training
    sources, parts = _parts(config, training[""])
    workers = process_count(config.workers)
    inputs = {"cell": cell.digest} | model_digests(config.models) | part_digests(sources)
    if config.paper_models is not None:
        inputs |= model_digests(config.paper_models, "paper")
    if config.program:
        inputs |= program_digests(config.program)
    inputs |= package_digests(config.rows)
    with opened_run(config, config.folder, inputs, scene_version=SCENE_VERSION, may_change=_MAY_CHANGE):
        if "certified" in config.rows:
            certify_missing(sources, config.models, workers, clearance=cell.clearance)
            keep_certified(config.folder, sources)
        trials = _trials(config, cell, sources, workers)
        facts = RunFacts(
            cell=config.cell,
            noise=cell.noise,
            seed=config.seed,
            parts=parts,
            trained_on=known_parts(config.rows, training, parts, "training_parts"),
            chosen_by=known_parts(config.rows, training, parts, "validation_parts"),
            known_families=known_families(config.rows, training, parts),
            settings=config.model_dump(mode="json"),
        )
        headline, sections = write_report(config.folder, trials, facts)
    print_sections(sections)
    print(f"\n{headline}\nwrote {config.folder}/report.html, report.json, trials.jsonl")


def _parts(config: BenchmarkConfig, training: dict) -> tuple[list[str], list[BenchmarkPart]]:
    """Names or folders of the parts, built where they are not yet, and their descriptions."""
    if config.parts:
        sources = part_names(config.parts, training, config.n_parts)
        if not sources:
            raise UsageError(
                f"--parts {' '.join(config.parts)} names no part; `python -m mskgrasp.parts list` does"
            )
        index = read_index().parts
        found = []
        for source in sources:
            part = find_part(source)
            split = index[part.name].split if part.name in index else "-"
            found.append(BenchmarkPart(name=part.name, family=part.family, split=split, standard=part.source))
        return sources, found
    listed = benchmark_parts(config.n_parts or (QUICK_PARTS if config.quick else 0))
    for part in progress(listed, unit="part", title="parts"):
        find_part(part.name)
    return [part.name for part in listed], listed


def known_parts(
    rows: Sequence[str], training: Mapping[str, Mapping], parts: Sequence[BenchmarkPart], use: str
) -> dict[str, int]:
    """Numbers of parts that the networks of each planner know, by planner, where positive.

    Args:
        rows: Names of the planners.
        training: Training of the networks of the planner ``paper``, and under an empty name of the others.
        parts: The parts.
        use: ``training_parts``, or ``validation_parts``.
    """
    return _counted(
        rows, lambda record: sum(part.name in (training[record].get(use) or ()) for part in parts)
    )


def known_families(
    rows: Sequence[str], training: Mapping[str, Mapping], parts: Sequence[BenchmarkPart]
) -> dict[str, int]:
    """Numbers of parts of whose families the networks of each planner were trained on, as `known_parts`."""
    built_in = frozenset(builtin_names())

    def count(record: str) -> int:
        names = training[record].get("training_parts") or ()
        families = {recipe_of(name).family for name in names if name in built_in}
        return sum(part.family in families for part in parts)

    return _counted(rows, count)


def _counted(rows: Sequence[str], count: Callable[[str], int]) -> dict[str, int]:
    """What is counted of the training record of each planner made of networks, where positive."""
    networks = [name for name in ("paper", "ours", "ours-min-quality", "certified") if name in rows]
    found = {name: count("paper" if name == "paper" else "") for name in networks}
    return {name: n for name, n in found.items() if n}


def program_digests(command: str) -> dict[str, str]:
    """A program's command, and digests of the files that it names; of what these read nothing is known."""
    words = shlex.split(command)
    paths = dict(zip(words, [Path(shutil.which(words[0]) or words[0]), *map(Path, words[1:])], strict=True))
    files = {f"program: {word}": file_digest(path) for word, path in paths.items() if os.path.isfile(path)}
    return {"program": command} | files


def _trials(
    config: BenchmarkConfig, cell: CellFile, sources: Sequence[str], workers: int
) -> list[PlacedTrial]:
    """All trials; those that are stored are not made again."""
    setup = BenchmarkSetup(
        cell=cell.write(config.folder),
        planners=PlannerSettings(
            models=config.models,
            paper_models=config.paper_models,
            program=config.program,
            out=config.folder,
        ),
        seed=config.seed,
    )
    tasks = scene_tasks(sources, cell.values["type"], config.n_trials, config.rows)
    made = placed_trials(trial_bench, setup, tasks, config.folder, workers)
    # Planner by planner, as the report lists them.
    return sorted(made, key=lambda trial: config.rows.index(trial.planner))
