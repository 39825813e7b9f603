"""The command ``mskgrasp``: every program as a subcommand."""

from __future__ import annotations

import importlib
import sys

from mskgrasp.core.version import __version__
from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred
from mskgrasp.runtime.programs import GROUPS, PROGRAMS

COMPLETION = "completion"
"""The subcommand that prints a shell's completion script."""

_EXAMPLE = """Order of work, for a part of your own:
  mskgrasp demo                                            # what a grasp and its shift look like
  mskgrasp plan --part my_bracket.stl                      # one grasp, planned: out/plan/plan.png
  mskgrasp assess my_bracket.stl --tolerance 1mm,2deg      # how precisely it can be grasped and placed
  mskgrasp collect --parts starter my_bracket --out data/mine   # data for networks that know your part
  mskgrasp train --data data/mine --out models/mine
  mskgrasp evaluate --models models/mine --parts my_bracket
  mskgrasp doctor --cell my_cell.yaml                      # on a real cell; then --cell everywhere

mskgrasp PROGRAM --help explains the options of a program and names the page about it; mskgrasp --version.
mskgrasp completion bash|zsh|tcsh prints a script that completes programs and options (docs/index.md)."""


def main() -> None:
    """Run the program named by the first argument with the other arguments, as ``python -m`` does."""
    name = sys.argv[1] if len(sys.argv) > 1 else "--help"
    if name in ("-h", "--help"):
        print(usage())
        sys.exit(0)
    if name == "--version":
        print(f"mskgrasp {__version__}")
        sys.exit(0)
    if name == COMPLETION:
        run(f"mskgrasp {COMPLETION}", lambda: _print_completion(sys.argv[2:]))
    if name not in PROGRAMS:
        print(f"mskgrasp: no program is called {name!r}; legal: {', '.join(PROGRAMS)}", file=sys.stderr)
        sys.exit(2)
    del sys.argv[1]
    module = PROGRAMS[name].module
    run(module, lambda: _run_program(module))


def usage() -> str:
    """Programs in groups, and the order of work."""
    groups = (
        f"{title}\n" + "\n".join(f"  {name:10} {one.purpose}" for name, one in programs.items())
        for title, programs in GROUPS.items()
    )
    return "\n\n".join(["usage: mskgrasp PROGRAM [OPTIONS]", *groups, _EXAMPLE])


def _run_program(module: str) -> int | None:
    with ctrl_c_deferred():
        program = importlib.import_module(f"{module}.__main__")
    return program.main()


def _print_completion(words: list[str]) -> None:
    with ctrl_c_deferred():
        from mskgrasp.runtime.completion import completion_script
    print(completion_script(" ".join(words)))


if __name__ == "__main__":
    main()
