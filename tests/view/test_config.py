"""Settings of the viewer."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.address import is_local
from mskgrasp.runtime.options import parse
from mskgrasp.view.config import ViewConfig


def test_by_default_this_machine_alone_opens_the_page_and_no_arm_moves():
    config = parse(ViewConfig, prog="view", description="", argv=())
    assert is_local(config.host) and not config.allow_remote and not config.allow_motion


@pytest.mark.parametrize("arguments", [("--port", "65536"), ("--seed", "-1")])
def test_what_cannot_be_is_refused(arguments: tuple[str, ...]):
    with pytest.raises(UsageError, match=f"{arguments[0]}: input should be"):
        parse(ViewConfig, prog="view", description="", argv=arguments)
