"""Exposure times of frames: the Kinect's ticks on this machine's monotonic clock."""

from __future__ import annotations

TICK_S = 0.125e-3
"""Unit of a frame's timestamp (libfreenect2, ``frame_listener.hpp``), s."""
DRIFT = 1e-4
"""Greatest relative drift of two quartz clocks."""
_WRAP = 1 << 32


class ExposureClock:
    """Alignment of ticks with arrivals: the frame with the least delay so far gives the offset.

    Args:
        latency_s: Greatest delay from exposure to arrival, s.
    """

    def __init__(self, latency_s: float):
        self._latency_s = latency_s
        self._last_ticks: int | None = None
        self._last_arrived_s = 0.0
        self._elapsed_s = 0.0
        self._offset_s = 0.0
        self._offset_at_s = 0.0

    def advance_s(self, ticks: int, arrived_s: float) -> float:
        """Time from the exposure of the last dated frame to that of this one, s; 0 or less: it is stale.

        Ticks wrap after six days: of the times that they may mean, that nearest to the time between arrivals.
        """
        if self._last_ticks is None:
            return float("inf")
        expected = round((arrived_s - self._last_arrived_s) / TICK_S)
        off = (ticks - self._last_ticks - expected + _WRAP // 2) % _WRAP - _WRAP // 2
        return (expected + off) * TICK_S

    def date(self, ticks: int, arrived_s: float) -> tuple[float, float]:
        """Date a frame.

        Args:
            ticks: Its timestamp.
            arrived_s: Its arrival, monotonic clock, s.

        Returns:
            exposed_s: Earliest time of its exposure, monotonic clock, s.
            late_s: Its delay beyond the least delay so far, s.
        """
        if self._last_ticks is None:
            self._offset_s, self._offset_at_s = arrived_s, arrived_s
        else:
            self._elapsed_s += self.advance_s(ticks, arrived_s)
            # A device clock that runs slow must not appear as growing delays.
            self._offset_s += DRIFT * (arrived_s - self._offset_at_s)
            self._offset_at_s = arrived_s
            self._offset_s = min(self._offset_s, arrived_s - self._elapsed_s)
        self._last_ticks, self._last_arrived_s = ticks, arrived_s
        quickest_s = self._elapsed_s + self._offset_s
        return quickest_s - self._latency_s, arrived_s - quickest_s
