from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tests.hal.kinect2.bench import FAKE, Bench


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(tmp_path, monkeypatch)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The fake package, imported in this process."""
    from hal.kinect2.driver import import_vendor

    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(FAKE))
    try:
        yield import_vendor()
    finally:
        for name in set(sys.modules) - before:
            if name.split(".")[0] in ("pylibfreenect2", "pkg_resources"):
                del sys.modules[name]
