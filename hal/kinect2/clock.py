"""When a frame was exposed: the Kinect's own ticks on this machine's monotonic clock."""

from __future__ import annotations

TICK_S = 0.125e-3
"""Unit of a frame's timestamp (libfreenect2, ``frame_listener.hpp``), s."""
DRIFT = 1e-4
"""Two quartz clocks drift apart by no more than this share of the time."""
_WRAP = 1 << 32


class ExposureClock:
    """Aligns ticks with arrivals: the frame that was quickest on its way so far shows the offset.

    Args:
        latency_s: A frame is never longer on its way, s.
    """

    def __init__(self, latency_s: float):
        self._latency_s = latency_s
        self._last_ticks: int | None = None
        self._elapsed_s = 0.0
        self._offset_s = 0.0
        self._offset_at_s = 0.0

    def advance_s(self, ticks: int) -> float:
        """How much later a frame was exposed than the last one that was dated, s; 0 or less: it is stale."""
        if self._last_ticks is None:
            return float("inf")
        return (((ticks - self._last_ticks + _WRAP // 2) % _WRAP) - _WRAP // 2) * TICK_S

    def date(self, ticks: int, arrived_s: float) -> tuple[float, float]:
        """Dates a frame.

        Args:
            ticks: Its timestamp; wraps round after six days.
            arrived_s: When it arrived here, monotonic clock, s.

        Returns:
            exposed_s: It was exposed then or later, monotonic clock, s.
            late_s: How much longer it was on its way than the quickest, s.
        """
        if self._last_ticks is None:
            self._offset_s, self._offset_at_s = arrived_s, arrived_s
        else:
            self._elapsed_s += self.advance_s(ticks)
            # A device clock that runs slow must not look like frames that come later and later.
            self._offset_s += DRIFT * (arrived_s - self._offset_at_s)
            self._offset_at_s = arrived_s
            self._offset_s = min(self._offset_s, arrived_s - self._elapsed_s)
        self._last_ticks = ticks
        quickest_s = self._elapsed_s + self._offset_s
        return quickest_s - self._latency_s, arrived_s - quickest_s
