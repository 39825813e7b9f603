"""The steps of a validation: closed-form checks, fidelity of parts, convergence, report."""

from __future__ import annotations

import os
from typing import Any

from mskgrasp.core.settings.physics import LEAST_RATE_HZ
from mskgrasp.parts import Part, chosen_names, find_part
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import Bar, progress
from mskgrasp.validate.body_scene import BodyScene
from mskgrasp.validate.closed_form import Check, run_checks
from mskgrasp.validate.compare import Comparison, cheapest, compare, complaints
from mskgrasp.validate.config import CELL_FLOOR, FLOOR, NOTHING_SKIPPED, REFERENCE, ValidateConfig
from mskgrasp.validate.convergence import draw_grasps, run_settings
from mskgrasp.validate.engines import compare_engines
from mskgrasp.validate.fidelity import check_parts
from mskgrasp.validate.report import (
    draw,
    print_checks,
    print_convergence,
    print_discards,
    print_fidelity,
    summarise_discards,
    write_json,
)


def validate(config: ValidateConfig) -> int:
    """Runs a validation; 0 if all checks pass, 1 otherwise.

    Raises:
        DriverMissing: A second engine is to be compared and is not installed.
    """
    names = chosen_names(config.parts or ("starter",))
    parts = [find_part(name) for name in progress(names, title="parts", unit="part")]
    make_folder(config.out)
    if config.engine == "mujoco":
        return compare_engines(config, parts)
    checks = _closed_form(config)
    print_checks(checks)
    fidelity = _fidelity(config, parts)
    print_fidelity(fidelity)
    failed = [check.name for check in checks if not check.passed]
    failed += [f"part {one.part}" for one in fidelity if not one.passed]
    results: dict[str, Any] = {
        "closed_form": [check.as_dict() for check in checks],
        "parts": [one.as_dict() for one in fidelity],
    }
    found = None
    if config.convergence:
        found = _convergence(config, parts, results)
        reference = found[REFERENCE].success_rate
        failed += [
            f"{config.production}: {said}"
            for said in complaints(found[config.production], found[FLOOR], reference)
        ]
    results["failed"] = failed
    write_json(config.out / "validate.json", config, results)
    picture = draw(config.out / "validate.png", checks, config, found)
    print(f"wrote {config.out / 'validate.json'} and {picture}")
    print(f"{len(failed)} of the checks failed: {'; '.join(failed)}" if failed else "all checks passed")
    return 1 if failed else 0


def _closed_form(config: ValidateConfig) -> list[Check]:
    with progress(title="closed form", unit="check") as bar:
        return run_checks(config.physics, lambda _: _advance(bar))


def _fidelity(config: ValidateConfig, parts: list[Part]) -> list:
    scene = BodyScene(config.physics, parts[0])
    try:
        with progress(total=len(parts), title="parts", unit="part") as bar:
            return check_parts(scene, parts, lambda: _advance(bar))
    finally:
        scene.close()


def _convergence(config: ValidateConfig, parts: list[Part], results: dict[str, Any]) -> dict[str, Comparison]:
    workers = config.workers or os.cpu_count() or 1
    folders = [part.folder for part in parts]
    settings = config.settings()
    n = len(parts) * config.grasps_per_part
    with progress(total=n, title="drawing grasps", unit="grasp") as bar:
        drawn = draw_grasps(
            folders,
            config.grasps_per_part,
            config.seed,
            config.out,
            workers,
            lambda k: _advance(bar, k),
        )
    with progress(total=n * len(settings), title="grasps", unit="grasp", keep=True) as bar:
        outcomes = run_settings(settings, drawn, config.out, workers, lambda k: _advance(bar, k))
    found = {name: compare(one, outcomes[REFERENCE]) for name, one in outcomes.items()}
    apart = (FLOOR, CELL_FLOOR, REFERENCE, NOTHING_SKIPPED, *config.variants)
    candidates = [
        setting.name
        for setting in settings
        if setting.physics.rate_hz >= LEAST_RATE_HZ and setting.name not in apart
    ]
    chosen = {
        floor: cheapest(found, found[floor], found[REFERENCE].success_rate, candidates)
        for floor in (FLOOR, CELL_FLOOR)
    }
    print_convergence(config, found, chosen)
    seen = summarise_discards(outcomes[config.production])
    print_discards(seen)
    results["convergence"] = {name: one.as_dict() for name, one in found.items()}
    results["cheapest_that_adds_nothing"] = chosen
    results["impossible"] = vars(seen)
    return found


def _advance(bar: Bar, by: int = 1) -> None:
    bar.update(by)
