"""A device in a with-block is open inside and closed outside, whatever happens."""

from __future__ import annotations

import pytest

from hal.device import Device
from hal.errors import NotConnected


class Lamp(Device):
    """Counts; it cannot be opened where it is broken."""

    def __init__(self, *, broken: bool = False):
        self.broken, self.lit, self.log = broken, False, list[str]()

    def connect(self) -> None:
        self.log.append("connect")
        if self.broken:
            raise NotConnected("no such lamp; plug it in")
        self.lit = True

    def close(self) -> None:
        self.log.append("close")
        self.lit = False


def test_construction_opens_nothing_and_the_block_closes_what_it_opened():
    lamp = Lamp()
    assert lamp.log == []
    with lamp as inside:
        assert inside is lamp and lamp.lit
    assert lamp.log == ["connect", "close"]


def test_an_error_in_the_block_closes_and_is_not_swallowed():
    lamp = Lamp()
    with pytest.raises(KeyboardInterrupt), lamp:
        raise KeyboardInterrupt
    assert lamp.log == ["connect", "close"]


def test_a_device_that_does_not_open_never_runs_the_block():
    lamp = Lamp(broken=True)
    with pytest.raises(NotConnected, match="plug it in"), lamp:
        pytest.fail("the block ran")
    assert lamp.log == ["connect"]


def test_a_device_without_its_verbs_cannot_be_made():
    class Half(Device):
        def connect(self) -> None: ...

    with pytest.raises(TypeError, match="close"):
        Half()  # type: ignore[abstract]
