"""Time to build parts, by family and stage. Run: python -m tests.benchmarks.build_parts --help.

Each chosen part is made from nothing in a cache folder of its own, on one core. Stages: ``draw`` makes the
exact mesh (and the hulls that the family knows), ``hulls`` decomposes or joins, ``fit`` compares hulls with
the mesh, ``rest`` finds the stable poses, ``write`` is mass, files and hashes.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections import defaultdict

import numpy as np
import trimesh
from rich.console import Console
from rich.table import Table

from mskgrasp.runtime.progress import progress

STAGES = ("draw", "hulls", "fit", "rest", "write")


def main() -> None:
    """Prints a row a family, and one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--per-family", type=int, default=2, help="parts of each family to make (default 2)")
    parser.add_argument("--family", help="this family alone")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        measure(options.per_family, options.family)


def measure(per_family: int, only: str | None) -> None:
    """Makes the parts and prints what they took."""
    from mskgrasp.parts import builtin_names
    from mskgrasp.parts.builtin import recipe_of

    families: dict[str, list[str]] = defaultdict(list)
    for name in builtin_names():
        families[recipe_of(name).family].append(name)
    if only is not None:
        families = {only: families[only]}
    chosen = {
        family: [names[int(i)] for i in np.linspace(0, len(names) - 1, min(per_family, len(names)))]
        for family, names in families.items()
    }
    warm_up(chosen)
    seconds: dict[str, np.ndarray] = {}
    with progress(total=sum(map(len, chosen.values())), unit="part") as bar:
        for family, names in sorted(chosen.items()):
            rows = []
            for name in names:
                rows.append(stages(name))
                bar.update()
            seconds[family] = np.mean(rows, axis=0)
    show(seconds, {family: len(names) for family, names in families.items()})


def warm_up(chosen: dict[str, list[str]]) -> None:
    """Loads the libraries, which a build pays for once a process."""
    from mskgrasp.parts.builtin import recipe_of
    from mskgrasp.parts.solids import decompose  # noqa: F401

    modules = {recipe_of(names[0]).make.__module__: names[0] for names in chosen.values()}
    for name in modules.values():
        stages(name)


def stages(name: str) -> list[float]:
    """Seconds of each stage for one part."""
    from mskgrasp.parts.builtin import build_part, recipe_of
    from mskgrasp.parts.solids.measure import hull_fit
    from mskgrasp.parts.solids.stable_poses import stable_poses
    from mskgrasp.parts.write_solid import with_hulls

    recipe = recipe_of(name)
    clock = time.process_time
    t0 = clock()
    drawn = recipe.make(recipe.dimensions)
    t1 = clock()
    solid = with_hulls(drawn)
    t2 = clock()
    mesh = trimesh.Trimesh(solid.mesh.vertices - solid.mesh.center_mass, solid.mesh.faces, process=False)
    hulls = [points - solid.mesh.center_mass for points in solid.hulls]
    t3 = clock()
    hull_fit(mesh, hulls)
    t4 = clock()
    stable_poses(np.concatenate(hulls))
    t5 = clock()
    build_part(name)
    whole = clock() - t5
    known = [t1 - t0, t2 - t1, t4 - t3, t5 - t4]
    return [*known, max(0.0, whole - sum(known))]


def show(seconds: dict[str, np.ndarray], counts: dict[str, int]) -> None:
    """The table, the estimate for the whole catalogue, and the JSON line."""
    table = Table(title="CPU seconds a part, by stage")
    table.add_column("family", no_wrap=True)
    for column in ("parts", *STAGES, "all"):
        table.add_column(column, justify="right")
    for family, row in sorted(seconds.items(), key=lambda item: -item[1].sum()):
        table.add_row(family, str(counts[family]), *(f"{s:.2f}" for s in row), f"{row.sum():.2f}")
    console = Console()
    (console if console.is_terminal else Console(width=110)).print(table)
    weight = np.array([counts[family] for family in seconds], dtype=float)
    mean = (weight[:, None] * np.array(list(seconds.values()))).sum(axis=0) / weight.sum()
    total = float(weight.sum() * mean.sum())
    result = {f"{stage}_s": round(float(s), 3) for stage, s in zip(STAGES, mean, strict=True)}
    result |= {"part_s": round(float(mean.sum()), 3), "parts": int(weight.sum())}
    print(json.dumps(result | {"catalogue_core_minutes": round(total / 60, 1)}))


if __name__ == "__main__":
    main()
