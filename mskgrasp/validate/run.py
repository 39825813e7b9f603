"""The steps of a validation: closed-form checks, fidelity of parts, comparisons, report."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.core.json_text import finite
from mskgrasp.parts import Part, chosen_names, find_part
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.reports.console import print_sections
from mskgrasp.runtime.cli import check_folder, make_folder
from mskgrasp.runtime.progress import Bar, note, progress
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.versions import versions
from mskgrasp.validate.altered_part import altered_part
from mskgrasp.validate.body_scene import BodyScene
from mskgrasp.validate.check import Check
from mskgrasp.validate.closed_form import run_checks
from mskgrasp.validate.config import Setting, ValidateConfig, variant_name
from mskgrasp.validate.convergence import measure_convergence
from mskgrasp.validate.engines import compare_engines
from mskgrasp.validate.equivalence import LEAST_PARTS
from mskgrasp.validate.fidelity import Fidelity, check_parts
from mskgrasp.validate.figure import draw
from mskgrasp.validate.outcomes import Outcomes, draw_grasps, run_settings
from mskgrasp.validate.tables import validation_sections


def validate(config: ValidateConfig) -> int:
    """Run a validation; 0 if all checks pass, 1 otherwise.

    Raises:
        DriverMissing: A second engine is to be compared and is not installed.
        UsageError: Two parts have the same name.
    """
    check_folder(config.out)
    names = chosen_names(config.parts or ("starter",))
    parts = [find_part(name) for name in progress(names, title="parts", unit="part")]
    counts = Counter(part.name for part in parts)
    for twice in (part for part in parts if counts[part.name] > 1):
        raise UsageError(f"--parts: two parts are called {twice.name!r}; leave one out")
    make_folder(config.out)
    if config.engine == "mujoco":
        return compare_engines(config, parts)
    checks = _closed_form(config)
    fidelity = _fidelity(config, parts)
    failed = [check.name for check in checks if not check.passed]
    failed += [f"part {one.part}" for one in fidelity if not one.passed]
    record: dict[str, Any] = {
        "settings": config.model_dump(mode="json"),
        "versions": versions(),
        "closed_form": finite([check.to_json() for check in checks]),
        "parts": [one.to_json() for one in fidelity],
    }
    print_sections(validation_sections(record))
    if config.convergence:
        found = measure_convergence(config, _simulate(config, parts))
        record |= found.to_json()
        print_sections(validation_sections(record)[2:])
        if len(parts) < LEAST_PARTS:
            note(
                f"fewer than {LEAST_PARTS} parts do not show whether production is equivalent to its "
                "references"
            )
        else:
            failed += [f"production, {config.production}: {said}" for said in found.choice.production_fails]
    record = finite(record | {"failed": failed})
    stored = config.out / "validate.json"
    write_whole(stored, (json.dumps(record, indent=1, allow_nan=False) + "\n").encode())
    picture = draw(config.out / "validate.png", record)
    print(f"wrote {stored} and {picture}")
    print(f"{len(failed)} of the checks failed: {'; '.join(failed)}" if failed else "all checks passed")
    return 1 if failed else 0


def _closed_form(config: ValidateConfig) -> list[Check]:
    with progress(title="closed form", unit="check") as bar:
        return run_checks(config.physics, lambda _: _advance(bar))


def _fidelity(config: ValidateConfig, parts: list[Part]) -> list[Fidelity]:
    scene = BodyScene(config.physics, parts[0])
    try:
        with progress(total=len(parts), title="parts", unit="part") as bar:
            return check_parts(scene, parts, lambda: _advance(bar))
    finally:
        scene.close()


def _simulate(config: ValidateConfig, parts: list[Part]) -> dict[str, Outcomes]:
    workers = process_count(config.workers)
    folders = [part.folder for part in parts]
    settings = config.settings()
    tried = {setting.name for setting in settings}
    for name in (variant_name(group, label) for group, labels in config.variants.items() for label in labels):
        if name not in tried:
            note(f"left out {name!r}: it lifts at more than production's rate, {config.physics.rate_hz} Hz")
    n = len(parts) * config.grasps_per_part
    with progress(total=n, title="drawing grasps", unit="grasp") as bar:
        drawn = draw_grasps(
            folders, config.grasps_per_part, config.seed, config.out, workers, lambda k: _advance(bar, k)
        )
    altered = _altered(config.out / "parts", settings, parts)
    n = sum(setting.n * len(altered.get(setting.name, parts)) for setting in settings)
    with progress(total=n, title="grasps", unit="grasp", keep=True) as bar:
        return run_settings(settings, drawn, altered, config.out, workers, lambda k: _advance(bar, k))


def _altered(folder: Path, settings: Sequence[Setting], parts: Sequence[Part]) -> dict[str, dict[str, Path]]:
    """Folders of altered parts by setting and part; parts that a setting leaves as they are are left out."""
    found: dict[str, dict[str, Path]] = {}
    for setting in settings:
        if not setting.hulls and setting.density == 1:
            continue
        own = found.setdefault(setting.name, {})
        place = folder / f"{setting.hulls or 'own'}-{setting.density:g}".replace(" ", "_")
        for part in parts:
            try:
                altered = altered_part(part, place, density=setting.density, hulls=setting.hulls)
            except BadPart as error:
                note(f"left out of {setting.name!r}: {error}")
                continue
            if setting.density != 1 or not _same_hulls(part, altered):
                own[part.name] = altered.folder
    return found


def _same_hulls(part: Part, other: Part) -> bool:
    return part.n_hulls == other.n_hulls and all(
        a.shape == b.shape and np.allclose(a, b, atol=1e-7)
        for a, b in zip(hull_corners(part), hull_corners(other), strict=True)
    )


def _advance(bar: Bar, by: int = 1) -> None:
    bar.update(by)
