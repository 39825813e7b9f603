from __future__ import annotations

from pathlib import Path

import pytest

from hal.replay import recorded_cell
from tests.hal.replay.program import run_on
from tests.hal.replay.toy import toy_cell


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "run.h5"
    with recorded_cell(toy_cell(), path).connected() as cell:
        run_on(cell, [])
    return path
