"""Completion of the command in a shell."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.completion import SHELLS, completion_script
from mskgrasp.runtime.programs import PROGRAMS

_COMPLETE = """source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _tyro_mskgrasp
printf '%s\\n' "${COMPREPLY[@]}" """


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "mskgrasp.bash"
    path.write_text(completion_script("bash"), encoding="utf-8")
    return path


def completed(script: Path, *words: str) -> list[str]:
    """What bash offers for the last word of a command line."""
    bash = shutil.which("bash")
    assert bash is not None
    command = [bash, "-c", _COMPLETE, str(script), "mskgrasp", *words]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout.splitlines()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("pl",), ["plan"]),
        (("plan", "--planner.p"), ["--planner.policy"]),
        (("plan", "--planner.policy", "q"), ["quality"]),
        (("train", "--conf"), ["--config"]),
        (("dataset", "export", "--f"), ["--format"]),
        (("parts", "sh"), ["sheet", "show"]),
    ],
)
def test_programs_commands_options_and_values_are_completed(script: Path, words, offered):
    assert sorted(completed(script, *words)) == offered


def test_all_programs_are_offered(script: Path):
    assert set(PROGRAMS) <= set(completed(script, ""))


def test_there_is_a_script_for_each_shell_and_no_other():
    assert "#compdef" in completion_script("zsh").splitlines()[0] and "zsh" in SHELLS
    with pytest.raises(UsageError, match="'fish'; legal: bash, zsh, tcsh"):
        completion_script("fish")
