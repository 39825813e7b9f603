"""The command that starts every program."""

from __future__ import annotations

import importlib
import importlib.metadata
import re
import subprocess
import sys

import pytest

from mskgrasp.__main__ import usage
from mskgrasp.runtime.programs import GROUPS, PROGRAMS


def _mskgrasp(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-X", "importtime", "-m", "mskgrasp", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def test_help_lists_the_programs_in_order_and_imports_nothing_heavy():
    done = _mskgrasp("--help")
    lines = done.stdout.splitlines()
    listed = [line.split()[0] for line in lines if line.startswith("  ")]
    assert done.returncode == 0 and listed[: len(PROGRAMS)] == list(PROGRAMS)
    assert [line for line in lines if line in GROUPS] == list(GROUPS)
    assert not any(name in done.stderr for name in ("numpy", "torch", "pydantic", "sapien"))


def test_the_order_of_work_in_the_help_names_programs_and_options_that_exist():
    taught = re.findall(r"^  mskgrasp (\w+)(.*?)(?:#.*)?$", usage(), flags=re.M)
    assert [name for name, _ in taught][:3] == ["demo", "plan", "assess"]
    for name, words in taught:
        module, _, kind = PROGRAMS[name].options.partition(":")
        fields = getattr(importlib.import_module(module), kind).model_fields
        options = [word[2:] for word in words.split() if word.startswith("--")]
        assert not [option for option in options if option not in fields]


def test_a_completion_script_is_printed_or_refused_in_one_line():
    assert "complete -F" in _mskgrasp("completion", "bash").stdout
    refused = _mskgrasp("completion", "csh")
    assert refused.returncode == 2 and refused.stderr.splitlines()[-1].endswith("legal: bash, zsh, tcsh")


def test_an_unknown_program_is_one_line_and_a_usage_error(monkeypatch, capsys):
    from mskgrasp.__main__ import main

    monkeypatch.setattr(sys, "argv", ["mskgrasp", "plann"])
    with pytest.raises(SystemExit) as ended:
        main()
    line = capsys.readouterr().err
    assert ended.value.code == 2 and line.count("\n") == 1
    assert "'plann'" in line and "plan, assess" in line


def test_the_version_is_that_of_the_package():
    assert _mskgrasp("--version").stdout == f"mskgrasp {importlib.metadata.version('mskgrasp')}\n"


def test_options_reach_the_program_and_its_exit_code_comes_back():
    done = _mskgrasp("plan", "--seed", "-1")
    assert done.returncode == 2 and "--seed" in done.stderr.splitlines()[-1]
