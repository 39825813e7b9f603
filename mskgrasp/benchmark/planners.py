"""Planners that are compared, by name."""

from __future__ import annotations

import hashlib
import shlex
import shutil
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

from hal.backends import find_backend, package_of
from hal.cell import Cell
from mskgrasp.benchmark.config import BUILT_IN, PROGRAM, BenchmarkConfig
from mskgrasp.core.errors import UsageError
from mskgrasp.parts import Part
from mskgrasp.planning.certified import read_certified
from mskgrasp.planning.certified_planner import CertifiedPlanner, reachable_by
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.image_planners import AntipodalPlanner, CentroidPlanner
from mskgrasp.planning.planner import Planner
from mskgrasp.planning.program_planner import ProgramPlanner
from mskgrasp.planning.proposal import GROUP, OtherPlanner, installed_planner
from mskgrasp.planning.run_inputs import kept_certified
from mskgrasp.runtime.run_folder import file_digest
from mskgrasp.trials.engine import PlansGrasps

_KNOWN = (*BUILT_IN, PROGRAM)
WITHOUT_POSE = tuple(name for name in _KNOWN if name != "certified")
"""Planners that do not find the part's pose by its CAD."""


@dataclass(frozen=True, kw_only=True)
class PlannerSettings:
    """What the planners are made of.

    Attributes:
        models: Folder of our networks.
        paper_models: Folder of the paper's; None: there are none.
        program: Command of the program that plans; empty: none.
        out: Folder of the run, which keeps the certified grasps.
    """

    models: Path
    out: Path
    paper_models: Path | None = None
    program: str = ""


def check_planners(config: BenchmarkConfig) -> None:
    """Refuse names of planners that cannot run, before a part is built.

    Raises:
        UsageError: A name is unknown, or what its planner needs is not given.
        BadBackend: Several packages have that name.
    """
    for name in config.rows:
        if find_backend(name, GROUP, _KNOWN, "--planners") is not None:
            continue
        if name == "paper" and config.paper_models is None:
            raise UsageError(
                "planner 'paper' needs --paper-models: the folder of networks trained with "
                "--config configs/train/paper.yaml"
            )
        if name == PROGRAM and not config.program:
            raise UsageError("planner 'program' needs --program: the command that starts it")
    if config.program and PROGRAM not in config.rows:
        raise UsageError("--program is given, but --planners does not name program; add it")
    if config.program:
        _check_program(config.program)


def _check_program(command: str) -> None:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise UsageError(f"--program {command!r}: {error}; close the quote") from error
    if not words or shutil.which(words[0]) is None:
        raise UsageError(f"--program {command!r}: there is no such program; give its path")


def package_digests(names: tuple[str, ...]) -> dict[str, str]:
    """Package, version and digest of the code of every planner that is not of this program."""
    others = [name for name in names if name not in _KNOWN]
    packages = {f"planner {name}": str(package_of(name, GROUP)) for name in others}
    found = entry_points(group=f"mskgrasp.{GROUP}")
    codes = {f"code of planner {one.name}": _code_digest(one.module) for one in found if one.name in others}
    return packages | codes


def _code_digest(module: str) -> str:
    """SHA-256 of all Python files of the package that holds a module, or of the module's own."""
    try:
        # Of the outermost package alone: to find a module within it would run the package's code.
        spec = find_spec(module.partition(".")[0])
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        return "not found"  # refused, with the remedy, when the planner is made
    digest = hashlib.sha256()
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    files = [(path.relative_to(one), path) for one in folders for path in one.rglob("*.py") if path.is_file()]
    if not folders and spec.has_location:
        files = [(Path(), Path(str(spec.origin)))]
    for name, path in sorted(files):
        if not any(part.startswith(".") for part in name.parts):  # what editors and notebooks leave
            digest.update(f"{name} {file_digest(path)}\n".encode())
    return digest.hexdigest()


@dataclass
class Planners:
    """Planners of a connected cell, made when they are first used.

    Attributes:
        cell: The cell.
        settings: What they are made of.
        stack: Ends the programs that were started.
    """

    cell: Cell
    settings: PlannerSettings
    stack: ExitStack
    _made: dict[str, PlansGrasps] = field(default_factory=dict)
    _certified: tuple[str, PlansGrasps] | None = None

    def of(self, name: str, part: Part) -> PlansGrasps:
        """The planner of a name, for a part.

        Raises:
            MskgraspError: It cannot be made.
        """
        if name == "certified":
            if self._certified is None or self._certified[0] != part.content_hash:
                self._certified = part.content_hash, self._certified_planner(part)
            return self._certified[1]
        return self._once(name, lambda: self._make(name))

    def _once(self, name: str, make: Callable[[], PlansGrasps]) -> PlansGrasps:
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    def _make(self, name: str) -> PlansGrasps:
        settings, workspace = self.settings, self.cell.workspace
        match name:
            case "centroid":
                return OtherPlanner(CentroidPlanner(workspace), workspace, name)
            case "antipodal":
                return OtherPlanner(AntipodalPlanner(workspace), workspace, name)
            case "paper":
                assert settings.paper_models is not None
                as_in_paper = PlannerConfig(recentre=False, sure_quality=0.0)
                return make_planner(settings.paper_models, as_in_paper, self.cell)
            case "ours":
                return make_planner(settings.models, PlannerConfig(), self.cell)
            case "ours-min-quality":
                return make_planner(settings.models, PlannerConfig().for_motion(), self.cell)
            case "program":
                program = ProgramPlanner(settings.program, workspace)
                self.stack.callback(program.close)
                return OtherPlanner(program, workspace, name)
            case _:
                return installed_planner(name, _KNOWN, workspace, "--planners")

    def _certified_planner(self, part: Part) -> CertifiedPlanner:
        networks = self._once("ours-min-quality", lambda: self._make("ours-min-quality"))
        assert isinstance(networks, Planner)
        grasps = read_certified(part, kept_certified(self.settings.out, part))
        return CertifiedPlanner(networks, part, grasps, reachable_by(self.cell))
