"""Assessment of parts: import, certification, trials, report, and the index of several."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hal.errors import LoadTooHeavy
from mskgrasp.assess.config import (
    LEAST_SIMULATIONS,
    AssessConfig,
    Tolerance,
    parse_tolerance,
)
from mskgrasp.assess.index import IndexEntry, write_index
from mskgrasp.assess.report import poses_section, trials_section, write_report
from mskgrasp.assess.summary import Row
from mskgrasp.assess.trials import EXACT, AssessSetup, scene_tasks, trial_bench, write_cells
from mskgrasp.core.errors import BadPart, MskgraspError, UsageError
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.builtin import is_known
from mskgrasp.parts.importing.mesh_files import LOADERS
from mskgrasp.parts.names import legal_name
from mskgrasp.planning.certified import FILE, CertifiedGrasps
from mskgrasp.planning.for_cell import check_unit, part_name
from mskgrasp.planning.run_inputs import BY_CONTENT, model_digests, part_digests
from mskgrasp.reports.console import print_sections
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import note
from mskgrasp.runtime.run_folder import TRIALS, opened_run, resume_trials, rewrite_trials
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.certify_parts import certify, certify_config
from mskgrasp.simulation.hull_count import USUAL_HULLS
from mskgrasp.trials.cell_file import check_loads
from mskgrasp.trials.placed_scenes import placed_trials
from mskgrasp.trials.placed_trial import PlacedTrial

SCENE_VERSION = 11
"""Raised by every change after which a seed makes other trials."""
_MAY_CHANGE = ("parts", "out", "tolerance", "trials", "workers", "quick", "simulations", *BY_CONTENT)


@dataclass(frozen=True)
class Assessed:
    """A part's result."""

    part: Part
    headline: str
    rows: list[Row]


def assess(config: AssessConfig) -> int:
    """Assess all parts, each in a folder of its own where there are several.

    Returns:
        The exit code: 1 where one of several parts could not be assessed, as the index says.

    Raises:
        UsageError: There is no part, or the folder holds other files.
        MskgraspError: The only part, or the model, cannot be used.
    """
    load_models(config.models)  # refused before a part is imported
    sources = _sources(config)
    tolerance = parse_tolerance(config.tolerance)
    if sources == [config.parts[0]]:  # not the only file of a folder, which gets an index
        out = config.out
        found = _assess_one(find_part(part_name(sources[0], config.unit)), config, out, tolerance)
        print(f"\n{found.headline}")
        print(f"wrote {out}/report.html, report.json, grasps.json, grasps.isaac.yaml")
        return 0
    make_folder(config.out)
    entries = []
    for number, source in enumerate(sources, 1):
        note(f"{source} ({number} of {len(sources)})")
        try:
            part = find_part(part_name(source, config.unit))
            found = _assess_one(part, config, config.out / part.name, tolerance)
        except MskgraspError as error:
            if isinstance(error, UsageError) and not isinstance(error, BadPart):
                raise
            note(f"{source}: {error}")
            entries.append(IndexEntry(name=Path(source).name, headline=str(error), rows=(), folder=None))
        else:
            entries.append(
                IndexEntry(name=part.name, headline=found.headline, rows=tuple(found.rows), folder=part.name)
            )
        write_index(config.out / "index.html", entries, tolerance)
    print(f"wrote {config.out}/index.html")
    return 1 if any(entry.folder is None for entry in entries) else 0


def _sources(config: AssessConfig) -> list[str]:
    """The parts named by the user; a folder without a part stands for its CAD files.

    Raises:
        UsageError: There is none, two would share a name, and with it a part and a folder of results, or a
            unit is given for one that is no file.
    """
    sources: list[str] = []
    for text in config.parts:
        path = Path(text)
        if path.is_dir() and not (path / "part.json").exists():
            files = sorted(str(file) for file in path.iterdir() if file.suffix.lower() in LOADERS)
            if not files and is_known(text):  # a folder of results, which has the name of its part
                files = [text]
            if not files:
                raise UsageError(
                    f"{text} holds no CAD file ({' '.join(sorted(LOADERS))}); name one, or another folder"
                )
            sources += files
        else:
            sources.append(text)
    if not sources:
        raise UsageError(
            "name a part, a part folder, a CAD file or a folder of them: "
            "python -m mskgrasp.assess bracket.stl"
        )
    unique: dict[Path | str, str] = {}
    for text in sources:
        unique.setdefault(Path(text).resolve() if Path(text).exists() else text, text)
    named: dict[str, str] = {}
    for text in unique.values():
        path = Path(text)
        check_unit(text, config.unit)
        try:
            if (path / "part.json").exists():
                name = find_part(text).name
            else:
                name = legal_name(path.stem if path.suffix.lower() in LOADERS else path.name)
        except MskgraspError:
            continue  # told when the part is assessed
        if named.setdefault(name, text) != text:
            raise UsageError(
                f"{named[name]} and {text} are both called {name!r}; rename one, or leave one out"
            )
    return list(unique.values())


def _assess_one(part: Part, config: AssessConfig, out: Path, tolerance: Tolerance) -> Assessed:
    # A part outside the cache is known by its folder alone.
    place = str(part.folder)
    workers = process_count(config.workers)
    inputs = {"part": part.name} | model_digests(config.models) | part_digests([place])
    with opened_run(config, out, inputs, scene_version=SCENE_VERSION, may_change=_MAY_CHANGE):
        cells = write_cells(out, config.clearance)
        n_simulations, n_trials = _sizes(part, config, cells[EXACT])
        settings = certify_config(
            n_simulations,
            factor=config.least_probability_factor(part.n_hulls),
            clearance=config.clearance,
            seed=config.seed,
        )
        certified = certify([place], settings, config.models, workers)[part.name]
        begin_trials(out, certified)
        trials = _trials(part, certified, config, cells, out, n_trials, workers)
        shown = config.model_dump(mode="json") | dict(simulations=n_simulations, trials=n_trials)
        headline, rows = write_report(out, part, certified, trials, tolerance, shown)
    print_sections(
        [
            poses_section(part, certified, out / "grasps.png"),
            trials_section(rows, tolerance, out / "shares.png"),
        ]
    )
    return Assessed(part=part, headline=headline, rows=rows)


def _sizes(part: Part, config: AssessConfig, cell_file: Path) -> tuple[int, int]:
    """Numbers of simulated grasps and of trials of a part; says why, where they are not the usual ones.

    Where the arm cannot carry the part nothing is tried, and the fewest grasps are simulated.
    """
    n_simulations, n_trials = config.n_simulations(part.n_hulls), config.n_trials(part.n_hulls)
    try:
        check_loads(cell_file, [part])
    except LoadTooHeavy:
        note(
            f"{part.name} ({part.mass:.1f} kg) is too heavy for the arm: nothing is tried, and few grasps "
            "are simulated"
        )
        return LEAST_SIMULATIONS, n_trials
    if part.n_hulls > USUAL_HULLS and not (config.simulations and config.trials):
        note(
            f"{part.name} has {part.n_hulls} convex pieces, whose contacts take long: about {n_simulations} "
            f"simulations, and {n_trials} trials with an exact camera (--simulations, --trials)"
        )
    return n_simulations, n_trials


def begin_trials(out: Path, certified: CertifiedGrasps) -> None:
    """Write ``grasps.json``, and remove stored trials that were planned by other certified grasps.

    More simulations give other grasps: a report must not mix trials of two sets of grasps.
    """
    path = out / FILE
    if path.exists() and path.read_bytes() == certified.contents():
        return
    stored = resume_trials(out / TRIALS, PlacedTrial.from_json)
    kept = [trial for trial in stored if trial.planner != "certified"]
    if len(kept) < len(stored):
        note(
            f"{len(stored) - len(kept)} trials are made again: '{certified.part}' has other certified grasps"
        )
        rewrite_trials(out / TRIALS, [trial.to_json() for trial in kept])
    certified.write(out)  # last: a run that is stopped before it removes them then


def _trials(
    part: Part,
    certified: CertifiedGrasps,
    config: AssessConfig,
    cells: dict[str, Path],
    out: Path,
    n_trials: int,
    workers: int,
) -> list[PlacedTrial]:
    setup = AssessSetup(
        source=str(part.folder),
        certified=certified,
        models=config.models,
        cells=cells,
        out=out,
        seed=config.seed,
    )
    return placed_trials(trial_bench, setup, scene_tasks(part, n_trials), out, workers)
