"""The files that each version number stands for, and digests of their code as of that version.

    python -m tests.versions            what has changed since
    python -m tests.versions --store    take today's code as what the numbers stand for

Comments, docstrings and imports do not count: they change no outcome.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sys
from collections.abc import Iterable
from pathlib import Path

from mskgrasp.parts.recipes import cad, families
from mskgrasp.parts.versions import IMPORT_VERSION, PART_VERSION
from mskgrasp.simulation.certify import CERTIFY_VERSION
from mskgrasp.simulation.select_certified import SELECT_VERSION
from mskgrasp.simulation.versions import SIMULATION_VERSION

ROOT = Path(__file__).parents[1]
STORED = Path(__file__).with_name("versions.json")

SIMULATION = (
    "tasks/**/*.py",
    "mskgrasp/core/settings/*.py",
    "mskgrasp/core/geometry.py",
    "mskgrasp/core/grasp.py",
    "mskgrasp/core/panda_kinematics.py",
    "mskgrasp/core/minimum_jerk.py",
    "mskgrasp/core/seeds.py",
    "mskgrasp/parts/hulls.py",
    "mskgrasp/parts/resting_pose.py",
    "mskgrasp/perception/depth_noise.py",
    "mskgrasp/perception/part_detection.py",
    "mskgrasp/simulation/shard.py",
)
PART = (
    "mskgrasp/parts/builtin.py",
    "mskgrasp/parts/write_solid.py",
    *(
        f"mskgrasp/parts/solids/{name}.py"
        for name in ("measure", "stable_poses", "solid", "pieces", "merging", "decompose", "overlap")
    ),
)
IMPORT = (
    *(f"mskgrasp/parts/importing/{name}.py" for name in ("import_file", "mesh_files", "repair", "bodies")),
    *(f"mskgrasp/parts/solids/{name}.py" for name in ("simplify", "surface", "layers", "mesh_pieces")),
    "mskgrasp/parts/importing/formats/*.py",
)
CERTIFY = tuple(f"mskgrasp/simulation/{name}.py" for name in ("certify", "pad_contact", "repeats"))
SELECT = ("mskgrasp/simulation/select_certified.py", "mskgrasp/simulation/pad_contact.py")


def current() -> dict[str, dict[str, object]]:
    """Of every number: its value, its files, and a digest of their code."""
    found = {
        "simulation": _entry(SIMULATION_VERSION, _files(SIMULATION)),
        "part": _entry(PART_VERSION, _files(PART)),
        "import": _entry(IMPORT_VERSION, _files(IMPORT)),
        "certify": _entry(CERTIFY_VERSION, _files(CERTIFY)),
        "select": _entry(SELECT_VERSION, _files(SELECT)),
    }
    modules: dict[str, set[int]] = {}
    for recipe in (*families.recipes().values(), *cad.recipes()):
        modules.setdefault(recipe.make.__module__, set()).add(recipe.version)
    for module, numbers in sorted(modules.items()):
        found[".".join(module.split(".")[-2:])] = _entry(max(numbers), _behind(module))
    return found


def changed() -> list[str]:
    """One line for each number whose code has changed since."""
    stored = json.loads(STORED.read_text(encoding="utf-8"))
    now = current()
    lines = []
    for name in sorted(stored.keys() | now.keys()):
        before, after = stored.get(name), now.get(name)
        if before != after:
            what = (
                "is new"
                if before is None
                else "is gone"
                if after is None
                else "has other code or another number"
            )
            lines.append(f"{name} {what}: {', '.join((after or before)['files'])}")
    return lines


def code_digest(text: str) -> str:
    """Digest of a module's code without comments, docstrings and imports."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [one for one in body if not _is_silent(one)] or [ast.Pass()]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.unparse(tree).encode()).hexdigest()


def _is_silent(node: ast.AST) -> bool:
    text = (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
    return text or isinstance(node, ast.Import | ast.ImportFrom)


def _entry(number: int, files: Iterable[str]) -> dict[str, object]:
    files = sorted(files)
    digests = "".join(code_digest((ROOT / file).read_text(encoding="utf-8")) for file in files)
    return {"number": number, "files": files, "code": hashlib.sha256(digests.encode()).hexdigest()[:16]}


def _files(patterns: Iterable[str]) -> list[str]:
    found = [[str(path.relative_to(ROOT)) for path in ROOT.glob(pattern)] for pattern in patterns]
    assert all(found), f"a pattern of {patterns} names no file"
    return [file for files in found for file in files]


def _behind(module: str) -> list[str]:
    """A recipe's module and the modules beside it that it uses; those of `part` count there."""
    pending, found = [module], set()
    shared = set(_files(PART))
    while pending:
        file = pending.pop().replace(".", "/") + ".py"
        if file in found or file in shared or not (ROOT / file).is_file():
            continue
        found.add(file)
        for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("mskgrasp.parts"):
                pending += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return sorted(found)


if __name__ == "__main__":
    if sys.argv[1:] == ["--store"]:
        STORED.write_text(json.dumps(current(), indent=1) + "\n", encoding="utf-8")
    print("\n".join(changed()) or "every number stands for the code it was stored with")
