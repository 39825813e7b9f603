"""Panel of a run: each trial with its depth image, plan and outcome."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import trimesh
from pydantic import TypeAdapter, ValidationError

from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import BadConfig, BadPart
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.settings import REGION, TABLE_Z, Region
from mskgrasp.parts import find_part
from mskgrasp.trials.trial_files import read_trial
from mskgrasp.view.dataset_panel import shift_text
from mskgrasp.view.page import Page, Panel, plain
from mskgrasp.view.plan_view import PlanView, Shown
from mskgrasp.view.scene import HandNode, add_part, add_region, part_mesh, place
from mskgrasp.view.stored_run import StoredTrial


class RunPanel(Panel):
    """Trials of a run.

    Args:
        page: The page.
        folder: Folder of the run.
        trials: Its trials.
    """

    def __init__(self, page: Page, folder: Path, trials: list[StoredTrial]):
        super().__init__(page, "run")
        self._trials = {trial.name: trial for trial in trials}
        self._meshes: dict[str, trimesh.Trimesh | None] = {}
        self._region = region_of(folder)
        self._name = f"{self.root.name}/trial"
        self._nodes = page.scene.add_frame(self._name, show_axes=False)
        gui = page.gui
        with self.folder:
            gui.add_markdown(f"{plain(folder)}: {len(trials)} trials")
            self.choice = gui.add_dropdown("trial", tuple(self._trials))
            self.text = gui.add_markdown("")
            self.picture = gui.add_image(np.full((8, 8, 3), 255, np.uint8), visible=False)
            self.view = PlanView(page, self)
        self.on(self.choice, self.draw)

    def shown(self) -> None:
        """Draw the chosen trial."""
        self.draw()

    def draw(self) -> None:
        """Draw the chosen trial.

        Raises:
            BadDataset: Its file is damaged.
        """
        trial = self._trials[self.choice.value]
        self.text.content = trial_text(trial)
        self._show_picture(trial.picture)
        self._nodes.remove()
        self._nodes = self.page.scene.add_frame(self._name, show_axes=False)
        if trial.file is None:
            self.view.show(None)
            self._draw_without_frame(trial)
            return
        mesh = None if trial.T_base_obj is None else self._mesh(trial.part)
        if mesh is not None:
            add_part(self.page.scene, f"{self._name}/before", mesh, trial.T_base_obj)
        frame, plan, _ = read_trial(trial.file)
        region = self._region
        if region is None and plan is not None:
            x, y, _ = plan.view.centre_base
            half = (REGION[1] - REGION[0]) / 2
            region = (x - half, x + half, y - half, y + half)
        self.view.show(
            Shown(
                frame=frame,
                table_z=TABLE_Z if plan is None else plan.view.table_z,
                region=region or REGION,
                plan=plan,
                mesh=mesh,
                T_base_obj=trial.T_base_obj,
                measured=trial.measured,
                point_base=trial.point_base,
            )
        )

    def _draw_without_frame(self, trial: StoredTrial) -> None:
        scene = self.page.scene
        add_region(scene, f"{self._name}/region", self._region or REGION, TABLE_Z)
        if trial.grasp is not None:
            HandNode(scene, f"{self._name}/hand").place(pose_base_tcp(trial.grasp))
        if trial.target is not None:
            x, y, theta = trial.target
            node = scene.add_frame(f"{self._name}/target", axes_length=0.03, axes_radius=0.001)
            turn = quat_about_z(np.asarray(theta))
            place(node, Pose(position=np.array([x, y, TABLE_Z]), quat_wxyz=turn))
            scene.add_label(f"{self._name}/target/label", "target")

    def _mesh(self, part: str) -> trimesh.Trimesh | None:
        if part not in self._meshes:
            try:
                self._meshes[part] = part_mesh(find_part(part))
            except BadPart:  # of another machine's parts: its points are shown
                self._meshes[part] = None
        return self._meshes[part]

    def _show_picture(self, path: Path | None) -> None:
        image = None if path is None else cv2.imread(str(path))
        self.picture.visible = image is not None
        if image is not None:
            self.picture.image = image[..., ::-1]


def region_of(folder: Path) -> Region | None:
    """Region of the simulated cell of a run: x_min, x_max, y_min, y_max, base frame, metres.

    None where the run is of another cell, whose file it does not hold.

    Raises:
        BadConfig: The cell's file is damaged.
    """
    path = folder / "cell.yaml"
    if not path.is_file():
        return None
    region = read_yaml(path).get("region", REGION)
    try:
        return TypeAdapter(Region).validate_python(region)
    except ValidationError as error:
        raise BadConfig(f"{path}: region {region!r} is not x_min, x_max, y_min, y_max") from error


def trial_text(trial: StoredTrial) -> str:
    """A trial in words, as Markdown."""
    lines = [f"**{plain(trial.outcome)}**"]
    if trial.predicted is not None:
        lines.append(f"expected: {shift_text(trial.predicted)}")
    if trial.measured is not None:
        lines.append(f"measured: {shift_text(trial.measured)}".replace("dz +nan", "dz not measured,"))
    return "\n\n".join(lines)
