"""Base classes of arms and cameras: context managers that connect and release."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Protocol, Self


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


class Resource(Protocol):
    """Resource that several devices share, such as a simulated world or a recording."""

    def open(self) -> None:
        """Open the resource for its first user; count the others."""
        ...

    def close(self) -> None:
        """Release the resource after its last user."""
        ...


class SharingDevice(Device):
    """A device that uses a resource together with others; a subclass sets the resource."""

    _resource: Resource
    _open: bool = False

    def connect(self) -> None:
        """Open the resource unless another device has opened it."""
        if not self._open:
            self._resource.open()
            self._open = True

    def close(self) -> None:
        """Release the resource unless another device still uses it; safe to call twice."""
        if self._open:
            self._open = False
            self._resource.close()

    def _connected(self) -> bool:
        return self._open
