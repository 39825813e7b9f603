"""A page whose server listens on a free port, and its nodes."""

from __future__ import annotations

from collections.abc import Iterator
from queue import Empty
from typing import Any

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose
from mskgrasp.view.page import Page
from mskgrasp.view.page_server import PageServer


@pytest.fixture
def page() -> Iterator[Page]:
    server = PageServer("127.0.0.1", 0, "test")
    try:
        yield Page(server)
    finally:
        server.stop()


def work(page: Page) -> None:
    """Does all work that waits."""
    while True:
        try:
            page.main.work_once(0.0)
        except Empty:
            return


def node(page: Page, name: str) -> Any:
    """The node of a name; there is one."""
    found = page.scene.get_handle_by_name(name)
    assert found is not None, name
    return found


def has_node(page: Page, name: str) -> bool:
    return page.scene.get_handle_by_name(name) is not None


def pose_of(page: Page, name: str) -> Pose:
    """Pose of a node in its parent's frame."""
    found = node(page, name)
    return Pose(position=np.array(found.position), quat_wxyz=np.array(found.wxyz))
