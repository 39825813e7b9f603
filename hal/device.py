"""Base class of arms and cameras: context managers that connect and release."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class Device(ABC):
    """A device. Construction neither connects nor moves; ``with`` does."""

    @abstractmethod
    def connect(self) -> None:
        """Open the device; nothing moves.

        Raises:
            DriverMissing, NotConnected: No driver, or no such device.
        """

    @abstractmethod
    def close(self) -> None:
        """Stop and release the device; safe to call twice."""

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
