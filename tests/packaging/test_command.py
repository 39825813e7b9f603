"""The command that starts every program."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from mskgrasp.__main__ import PROGRAMS


def _mskgrasp(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-X", "importtime", "-m", "mskgrasp", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def test_help_lists_the_programs_in_order_and_imports_nothing_heavy():
    done = _mskgrasp("--help")
    listed = [line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ")]
    assert done.returncode == 0 and listed == list(PROGRAMS)
    assert not any(name in done.stderr for name in ("numpy", "torch", "pydantic", "sapien"))


def test_every_program_is_a_module_that_can_be_run():
    for module, _ in PROGRAMS.values():
        spec = importlib.util.find_spec(module)
        assert spec is not None
        if spec.submodule_search_locations is not None:
            assert importlib.util.find_spec(f"{module}.__main__") is not None


def test_an_unknown_program_is_one_line_and_a_usage_error(monkeypatch, capsys):
    from mskgrasp.__main__ import main

    monkeypatch.setattr(sys, "argv", ["mskgrasp", "plann"])
    with pytest.raises(SystemExit) as ended:
        main()
    line = capsys.readouterr().err
    assert ended.value.code == 2 and line.count("\n") == 1
    assert "'plann'" in line and "plan, evaluate" in line


def test_options_reach_the_program_and_its_exit_code_comes_back():
    done = _mskgrasp("plan", "--seed", "-1")
    assert done.returncode == 2 and "--seed" in done.stderr.splitlines()[-1]
