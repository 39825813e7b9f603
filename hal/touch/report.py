"""Report of a table that was touched: text, JSON and a figure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hal.touch.plane import TouchedPlane
from mskgrasp.core.palette import BLUE, FAINT, LINE, ORANGE
from mskgrasp.reports.style import saved_figure


@dataclass(frozen=True, kw_only=True)
class TableReport:
    """A table that was touched.

    Attributes:
        cell: The cell's file.
        made: Date and time.
        region: x_min, x_max, y_min, y_max, base frame, metres.
        stated_z: Height that the cell stated, base frame, metres; None if it stated none.
        points: (n, 3) touched points, base frame, metres.
        plane: Plane through them.
        force: Force that was a touch, N.
        speed: Speed towards the table, m/s.
    """

    cell: str
    made: str
    region: tuple[float, float, float, float]
    stated_z: float | None
    points: np.ndarray
    plane: TouchedPlane
    force: float
    speed: float

    def to_json(self) -> dict[str, Any]:
        """Plain values; lengths in metres, angles in degrees."""
        plane = self.plane
        return {
            "cell": self.cell,
            "made": self.made,
            "region": list(self.region),
            "stated_table_z": self.stated_z,
            "table_z": plane.z,
            "table_slope": list(plane.slope),
            "tilt_deg": float(np.degrees(plane.tilt_rad)),
            "rise": plane.rise,
            "tilt_matters": not plane.level,
            "points": self.points.tolist(),
            "residuals": plane.residuals.tolist(),
            "force": self.force,
            "speed": self.speed,
        }

    def lines(self) -> list[str]:
        """The result as lines of text."""
        plane = self.plane
        against = (
            "" if self.stated_z is None else f", {1e3 * (plane.z - self.stated_z):+z.2f} mm from the stated"
        )
        off = ", ".join(f"{1e3 * value:+z.2f}" for value in plane.residuals)
        matters = "no line is needed for it" if plane.level else "written as table_slope"
        return [
            f"table      table_z {plane.z:.5f} m in the middle of the region{against}",
            f"tilt       {np.degrees(plane.tilt_rad):.2f} degrees, {1e3 * plane.rise:.2f} mm up to a corner "
            f"of the region; {matters}",
            f"residuals  {off} mm from the plane",
        ]


def draw_table(report: TableReport, path: Path) -> None:
    """Draw the touched points in the region, with the plane's contour lines, and the residuals."""
    plane, points = report.plane, report.points
    x_min, x_max, y_min, y_max = report.region
    x, y = np.linspace(x_min, x_max, 60), np.linspace(y_min, y_max, 60)
    across_x, across_y = np.meshgrid(x - (x_min + x_max) / 2, y - (y_min + y_max) / 2)
    rise = 1e3 * (across_x * plane.slope[0] + across_y * plane.slope[1])
    with saved_figure(path, 9, 4) as figure:
        above, beside = figure.subplots(1, 2, width_ratios=(1.2, 1))
        if np.ptp(rise) > 0.02:
            above.clabel(above.contour(y, x, rise.T, 6, colors=LINE), fmt="%.1f mm", colors=FAINT, fontsize=8)
        above.plot(points[:, 1], points[:, 0], "o", color=BLUE)
        for number, point in enumerate(points):
            above.annotate(
                f"{number + 1}: {1e3 * point[2]:.2f} mm", (point[1], point[0]), (0, 7), fontsize=8,
                ha="center", textcoords="offset points",
            )  # fmt: skip
        above.set_title(f"z {1e3 * plane.z:.2f} mm, tilt {np.degrees(plane.tilt_rad):.2f} degrees")
        above.set_xlabel("y, m")
        above.set_ylabel("x, m")
        above.set_aspect("equal")
        above.set_xlim(y_max + 0.06, y_min - 0.06)  # as seen from behind the robot
        above.set_ylim(x_min - 0.03, x_max + 0.03)
        beside.bar(np.arange(1, len(points) + 1), 1e3 * plane.residuals, color=ORANGE)
        beside.axhline(0, color=FAINT, linewidth=0.8)
        beside.set_title("residuals")
        beside.set_xlabel("point")
        beside.set_ylabel("height over the plane, mm")
