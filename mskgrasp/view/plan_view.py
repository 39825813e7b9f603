"""A plan drawn over its depth image, with the controls of what is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from viser import GuiCheckboxHandle

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose
from mskgrasp.core.palette import GREEN, ORANGE
from mskgrasp.core.settings import Region
from mskgrasp.perception.footprint import pixel_pitch, seen_points
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.view.ghosts import expected_motion, likely_motions, motion_of
from mskgrasp.view.page import Page, Panel
from mskgrasp.view.scene import (
    HandNode,
    add_candidates,
    add_cloud,
    add_part,
    add_region,
    add_shift,
    drawn_points,
    rgb,
)

MARGIN = 0.004
"""Points this far around a detected part's box are drawn as its own, metres."""
OVER = 0.012
"""Height over the part at which the arrow of its shift is drawn, metres."""


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What is drawn of a plan.

    Attributes:
        frame: The depth image.
        table_z: Height of the table, base frame, metres.
        region: Where parts lie.
        plan: The plan; None where there is none.
        mesh: The part's mesh, obj frame; None where the part or its pose is not known: its ghosts are made of
            the points that are seen.
        T_base_obj: Its pose before the grasp; None likewise.
        measured: (4,) displacement of ``point_base`` as measured, axes of the grasp frame; None: not yet.
        point_base: (3,) the point that was measured, base frame; None: the seen centre.
    """

    frame: RgbdFrame
    table_z: float
    region: Region
    plan: GraspPlan | None = None
    mesh: trimesh.Trimesh | None = None
    T_base_obj: Pose | None = None
    measured: np.ndarray | None = None
    point_base: np.ndarray | None = None


class PlanView:
    """Nodes and controls of a plan in a panel, made within the panel's folder."""

    def __init__(self, page: Page, panel: Panel):
        self._page = page
        self._name = f"{panel.root.name}/plan"
        self._nodes = page.scene.add_frame(self._name, show_axes=False)
        self._shown: Shown | None = None
        gui = page.gui

        def box(label: str) -> GuiCheckboxHandle:
            return gui.add_checkbox(label, True)

        with gui.add_folder("drawn"):
            self.cloud, self.candidates = box("depth image"), box("candidates")
            self.least = gui.add_slider("least quality", 0.0, 1.0, 0.01, 0.0)
            self.chosen, self.expected = box("chosen grasp"), box("expected shift")
            self.magnified = gui.add_slider("arrow, times", 1, 20, 1, 5)
            self.spread = gui.add_checkbox("2 sigma ghosts", False)
        for control in (
            self.cloud, self.candidates, self.least, self.chosen, self.expected, self.magnified, self.spread,
        ):  # fmt: skip
            panel.on(control, self._draw)

    def show(self, shown: Shown | None) -> None:
        """Draw a plan in place of the last one; None: nothing."""
        self._shown = shown
        self._draw()

    def _draw(self) -> None:
        with self._page.server.atomic():
            self._nodes.remove()
            self._nodes = self._page.scene.add_frame(self._name, show_axes=False)
            shown = self._shown
            if shown is None:
                return
            add_region(self._page.scene, f"{self._name}/region", shown.region, shown.table_z)
            if self.cloud.value:
                self._draw_cloud(shown)
            if shown.plan is not None:
                self._draw_plan(shown, shown.plan)

    def _draw_cloud(self, shown: Shown) -> None:
        points = seen_points(shown.frame)
        drawn = drawn_points(points, shown.region, shown.table_z)
        colours = shown.frame.colour.reshape(-1, 3)[drawn]
        pitch = pixel_pitch(shown.frame)
        add_cloud(self._page.scene, f"{self._name}/cloud", points[drawn], colours, pitch)

    def _draw_plan(self, shown: Shown, plan: GraspPlan) -> None:
        scene, name = self._page.scene, self._name
        if self.candidates.value:
            good = ~(plan.qualities < self.least.value)  # a planner that predicts none shows all
            if good.any():
                add_candidates(scene, f"{name}/candidates", plan.candidates[good], plan.qualities[good])
        if self.chosen.value:
            HandNode(scene, f"{name}/chosen", opacity=0.6).place(plan.grasp.T_base_tcp)
        if self.expected.value:
            self._draw_ghost("expected", shown, expected_motion(plan), rgb(ORANGE), 0.5)
            self._draw_shift(plan)
        if self.spread.value:
            for number, motion in enumerate(likely_motions(plan)):
                self._draw_ghost(f"spread{number}", shown, motion, rgb(ORANGE), 0.12)
        if shown.measured is not None:
            point = plan.view.centre_base if shown.point_base is None else shown.point_base
            # A measurement in the plane says nothing of the height.
            measured = np.nan_to_num(shown.measured)
            motion = motion_of(plan.grasp.T_base_grasp, measured, point)
            self._draw_ghost("measured", shown, motion, rgb(GREEN), 0.5)

    def _draw_shift(self, plan: GraspPlan) -> None:
        """Draw the shift of the seen centre and its ellipsoid over the part, where both can be seen."""
        times = float(self.magnified.value)
        start = plan.view.centre_base + np.array([0.0, 0.0, plan.view.size[2] / 2 + OVER])
        axes = Pose(position=start, quat_wxyz=plan.grasp.T_base_grasp.quat_wxyz)
        shift, covariance = times * plan.displacement[:3], times**2 * plan.displacement_cov[:3, :3]
        add_shift(self._page.scene, f"{self._name}/shift", axes, shift, covariance, rgb(ORANGE))
        if times != 1:
            above = shift + np.array([0.0, 0.0, OVER])
            self._page.scene.add_label(f"{self._name}/shift/label", f"{times:g} times", position=above)

    def _draw_ghost(
        self, name: str, shown: Shown, motion: Pose, colour: tuple[int, int, int], opacity: float
    ) -> None:
        scene, full = self._page.scene, f"{self._name}/{name}"
        if shown.mesh is not None and shown.T_base_obj is not None:
            add_part(scene, full, shown.mesh, motion @ shown.T_base_obj, colour=colour, opacity=opacity)
        else:
            points = motion.apply(_part_points(shown))
            add_cloud(scene, full, points, colour, pixel_pitch(shown.frame))


def _part_points(shown: Shown) -> np.ndarray:
    """The points (n, 3) of a detected part, base frame, metres."""
    assert shown.plan is not None
    view, points = shown.plan.view, seen_points(shown.frame)
    points = points[np.isfinite(points).all(axis=1)]
    own = view.T_base_box.inverse().apply(points)
    inside = (np.abs(own[:, :2]) <= view.size[:2] / 2 + MARGIN).all(axis=1)
    return points[inside & (points[:, 2] > view.table_z + view.table_offset + 0.1 * view.size[2])]
