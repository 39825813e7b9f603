"""Panel of a part: mesh, collision hulls, resting poses."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import REGION, TABLE_Z
from mskgrasp.parts import Part
from mskgrasp.view.page import Page, Panel, plain
from mskgrasp.view.scene import add_hulls, add_part, part_mesh

ALL = "all, side by side"


class PartPanel(Panel):
    """A part in its resting poses.

    Args:
        page: The page.
        part: The part.
    """

    def __init__(self, page: Page, part: Part):
        super().__init__(page, "part")
        self.part = part
        self._nodes = page.scene.add_frame(f"{self.root.name}/poses", show_axes=False)
        gui = page.gui
        with self.folder:
            gui.add_markdown(part_text(part))
            options = [pose_text(part, number) for number in self._by_probability()]
            self.pose = gui.add_dropdown("resting pose", (*options, ALL))
            self.mesh = gui.add_checkbox("mesh", True)
            self.hulls = gui.add_checkbox("hulls", False)
            self.frames = gui.add_checkbox("obj frame", False)
        for control in (self.pose, self.mesh, self.hulls, self.frames):
            self.on(control, self.draw)

    def shown(self) -> None:
        """Draw the part."""
        self.draw()

    def draw(self) -> None:
        """Draw the part as the controls say."""
        scene, part = self.page.scene, self.part
        self._nodes.remove()
        self._nodes = scene.add_frame(f"{self.root.name}/poses", show_axes=False)
        numbers = self._by_probability()
        if self.pose.value != ALL:
            numbers = [number for number in numbers if pose_text(part, number) == self.pose.value]
        mesh = part_mesh(part) if self.mesh.value else None
        for number, pose in zip(numbers, side_by_side(part, numbers), strict=True):
            name = f"{self._nodes.name}/{number}"
            size = 0.3 * float(np.linalg.norm(part.extents))
            scene.add_frame(
                name, show_axes=self.frames.value, axes_length=size, axes_radius=0.02 * size,
                position=np.asarray(pose.position), wxyz=np.asarray(pose.quat_wxyz),
            )  # fmt: skip
            if mesh is not None:
                add_part(scene, f"{name}/mesh", mesh, opacity=0.35 if self.hulls.value else None)
            if self.hulls.value:
                add_hulls(scene, f"{name}/hulls", part)

    def _by_probability(self) -> list[int]:
        return np.argsort(-self.part.resting_probability, kind="stable").tolist()


def pose_text(part: Part, number: int) -> str:
    """A resting pose in words."""
    return f"{number}: {part.resting_probability[number]:.1%}"


def side_by_side(part: Part, numbers: list[int]) -> list[Pose]:
    """``T_base_obj`` of resting poses: a row along base y through the middle of the region."""
    x_min, x_max, y_min, y_max = REGION
    step = 1.2 * float(np.linalg.norm(part.extents))
    poses = []
    for column, number in enumerate(numbers):
        y = (y_min + y_max) / 2 + (column - (len(numbers) - 1) / 2) * step
        height = TABLE_Z + part.resting.position[number, 2]
        poses.append(
            Pose(
                position=np.array([(x_min + x_max) / 2, y, height]), quat_wxyz=part.resting.quat_wxyz[number]
            )
        )
    return poses


def part_text(part: Part) -> str:
    """A part's properties in words, as Markdown."""
    size = " x ".join(f"{1e3 * edge:.1f}" for edge in part.extents)
    return (
        f"**{plain(part.name)}** ({plain(part.family)}; {plain(part.source)})\n\n"
        f"{size} mm, {1e3 * part.mass:.1f} g; {part.n_hulls} hulls, {part.grade}: 95 % within "
        f"{1e3 * part.hull_error_p95:.2f} mm of the mesh, at most {1e3 * part.hull_error:.2f} mm off"
    )
