"""A cache folder of the tests' own; the built-in parts are made once for all of them."""

import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

import pytest

from mskgrasp.parts import Part, build_part, starter_names
from mskgrasp.parts.commands.command_line import main
from tests.programs import Ended, run_here


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the built-in parts, for all processes of the tests; tests must not write to it."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared-cache"
    folder.mkdir(exist_ok=True)
    return folder


class BuiltIn(Mapping[str, Part]):
    """The starter parts by name, each made when it is first asked for."""

    def __init__(self, cache: Path):
        self._cache = cache
        self._made: dict[str, Part] = {}

    def __getitem__(self, name: str) -> Part:
        if name not in starter_names():
            raise KeyError(name)
        if name not in self._made:
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("XDG_CACHE_HOME", str(self._cache))
                self._made[name] = build_part(name)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(starter_names())

    def __len__(self) -> int:
        return len(starter_names())


@pytest.fixture(scope="session")
def builtin_parts(shared_cache: Path) -> BuiltIn:
    return BuiltIn(shared_cache)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache folder for every test."""
    cache = tmp_path / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    yield cache / "mskgrasp" / "parts"


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Ended]:
    """Runs ``mskgrasp.parts`` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return partial(run_here, main)
