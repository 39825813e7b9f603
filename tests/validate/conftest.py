"""A scene for experiments with plain bodies, under the production settings."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from mskgrasp.core.settings import Physics
from mskgrasp.validate.body_scene import BodyScene, Workshop


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return Workshop(tmp_path_factory.mktemp("bodies"))


@pytest.fixture(scope="session")
def scene(workshop: Workshop) -> Iterator[BodyScene]:
    made = BodyScene(Physics(), workshop.block())
    yield made
    made.close()
