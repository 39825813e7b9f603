"""Settings of the server."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.options import parse
from mskgrasp.serve.config import ServeConfig, is_local


def test_by_default_the_shipped_model_serves_this_machine_alone():
    config = parse(ServeConfig, prog="serve", description="", argv=())
    assert (
        (config.models / "model.safetensors").is_file()
        and is_local(config.host)
        and config.token_file is None
    )


@pytest.mark.parametrize(
    ("host", "local"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True), ("0.0.0.0", False),
     ("::", False), ("192.168.1.2", False), ("localhost.example.org", False), ("", False)],
)  # fmt: skip
def test_only_loopback_addresses_are_local(host: str, local: bool):
    assert is_local(host) is local


def test_a_policy_that_needs_the_parts_cad_is_refused():
    with pytest.raises(UsageError, match="--planner: policy certified needs the part's CAD"):
        parse(ServeConfig, prog="serve", description="", argv=("--planner.policy", "certified"))


@pytest.mark.parametrize(
    "arguments", [("--port", "65536"), ("--workers", "0"), ("--timeout-s", "0"), ("--max-body-mb", "-1")]
)
def test_what_cannot_be_is_refused(arguments: tuple[str, ...]):
    with pytest.raises(UsageError, match=f"{arguments[0]}: input should be"):
        parse(ServeConfig, prog="serve", description="", argv=arguments)
