"""Settings of the server."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.address import is_local
from mskgrasp.runtime.options import parse
from mskgrasp.serve.config import ServeConfig


def test_by_default_the_shipped_model_serves_this_machine_alone():
    config = parse(ServeConfig, prog="serve", description="", argv=())
    assert (
        (config.models / "model.safetensors").is_file()
        and is_local(config.host)
        and config.token_file is None
    )


def test_a_policy_that_needs_the_parts_cad_is_refused():
    with pytest.raises(UsageError, match="--planner: policy certified needs the part's CAD"):
        parse(ServeConfig, prog="serve", description="", argv=("--planner.policy", "certified"))


@pytest.mark.parametrize(
    "arguments", [("--port", "65536"), ("--workers", "-1"), ("--timeout-s", "0"), ("--max-body-mb", "-1")]
)
def test_what_cannot_be_is_refused(arguments: tuple[str, ...]):
    with pytest.raises(UsageError, match=f"{arguments[0]}: input should be"):
        parse(ServeConfig, prog="serve", description="", argv=arguments)
