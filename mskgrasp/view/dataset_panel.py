"""Panel of a dataset: attempts at a part, before and after, and simulated again."""

from __future__ import annotations

import numpy as np
import trimesh

from hal.camera import RgbdFrame
from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES, Grasp, pose_base_grasp, pose_base_tcp
from mskgrasp.core.palette import GREEN, ORANGE, RED
from mskgrasp.dataset import Dataset
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.footprint import pixel_pitch, seen_points
from mskgrasp.view.attempt_list import ALL, AttemptList, resting_poses
from mskgrasp.view.motion import Player
from mskgrasp.view.page import Page, Panel, plain
from mskgrasp.view.replay import AttemptSimulator, Replay
from mskgrasp.view.scene import (
    HandNode,
    add_closing_lines,
    add_cloud,
    add_part,
    add_region,
    drawn_points,
    part_mesh,
    rgb,
)

MOST_SHIFT_MM = 50.0


class DatasetPanel(Panel):
    """Attempts of a dataset.

    Args:
        page: The page.
        dataset: The dataset.
        part: Name of the part that is shown first; None: the first one of the dataset.

    Raises:
        UsageError: The dataset has no attempts at that part.
        BadDataset: A shard is damaged.
    """

    def __init__(self, page: Page, dataset: Dataset, part: str | None = None):
        super().__init__(page, "dataset")
        self._dataset = dataset
        self._name = f"{self.root.name}/attempt"
        self._nodes = page.scene.add_frame(self._name, show_axes=False)
        self.simulator = AttemptSimulator()
        self._without_mesh = ""
        gui = page.gui
        names = dataset.part_names
        first = names[0] if part is None else part
        self.attempts = AttemptList.of(dataset, first)
        with self.folder:
            self.choice = gui.add_dropdown("part", names, initial_value=first)
            self.outcome = gui.add_dropdown("outcome", self.attempts.outcomes())
            self.resting = gui.add_dropdown("resting pose", [ALL])
            self.shift = gui.add_multi_slider("shift, mm", 0.0, MOST_SHIFT_MM, 0.5, (0.0, MOST_SHIFT_MM))
            self.number = gui.add_slider("attempt", 0, 1, 1, 0)
            self.previous, self.next = gui.add_button("previous"), gui.add_button("next")
            self.text = gui.add_markdown("")
            with gui.add_folder("drawn"):
                self.cloud, self.hand = gui.add_checkbox("depth image", True), gui.add_checkbox("hand", True)
                self.before, self.after = gui.add_checkbox("before", True), gui.add_checkbox("after", True)
                self.others = gui.add_checkbox("grasps of the filter", False)
            self.again = gui.add_button("simulate again")
            self.player = Player(page, self)
        self.on(self.choice, self.read)
        for control in (self.outcome, self.resting, self.shift):
            self.on(control, self.filter)
        for control in (self.number, self.cloud, self.hand, self.before, self.after, self.others):
            self.on(control, self.draw)
        self.on(self.previous, lambda: self._step(-1))
        self.on(self.next, lambda: self._step(1))
        self.on(self.again, self.simulate)
        self.read()

    def shown(self) -> None:
        """Say why the part has no mesh, if it has none."""
        self.page.tell(plain(self._without_mesh))

    def read(self) -> None:
        """Read the attempts at the chosen part."""
        self.attempts = AttemptList.of(self._dataset, self.choice.value)
        self.part, self.mesh = self._find_part()
        self._lying = None
        if self.part is not None:
            self._lying = resting_poses(self.attempts.columns["pose_base_obj"][:, 3:], self.part)
        self.outcome.options = tuple(self.attempts.outcomes())
        lying = [] if self._lying is None else np.unique(self._lying).tolist()
        self.resting.options = (ALL, *map(str, lying))
        self.again.disabled = self.part is None
        self.filter()

    def filter(self) -> None:
        """Apply the filter and show the first attempt that passes."""
        which = None if self.resting.value == ALL else int(self.resting.value)
        low, high = (1e-3 * value for value in self.shift.value)
        if self.shift.value[1] >= MOST_SHIFT_MM:
            high = np.inf
        self.chosen = self.attempts.chosen(self.outcome.value, self._lying, which, (low, high))
        # A slider needs two values.
        self.number.max = max(1, len(self.chosen) - 1)
        self.number.value = 0
        self.draw()

    def draw(self) -> None:
        """Draw the attempt as the controls say."""
        self.player.clear()
        self.page.tell(plain(self._without_mesh))  # in place of the outcome of another attempt
        with self.page.server.atomic():
            self._nodes.remove()
            self._nodes = self.page.scene.add_frame(self._name, show_axes=False)
            if not len(self.chosen):
                self.text.content = f"none of {len(self.attempts)} attempts passes the filter"
                return
            self._draw(self._current())

    def simulate(self) -> None:
        """Simulate the attempt again, compare its outcome with the stored one, and play it."""
        if self.part is None or self.mesh is None or not len(self.chosen):
            return
        number = self._current()
        self.page.tell("simulating the attempt ...")
        row = {name: values[number] for name, values in self.attempts.columns.items()}
        replay = self.simulator.simulate(self.part, self.attempts.info(number), row)
        stored = FAILURES[int(row["failure"])]
        self.page.tell(comparison_text(replay, stored, row["displacement"]))
        self._nodes.visible = False
        self.player.load(replay.motion, self.mesh)

    def _current(self) -> int:
        return int(self.chosen[min(self.number.value, len(self.chosen) - 1)])

    def _step(self, by: int) -> None:
        self.number.value = int(np.clip(self.number.value + by, 0, max(0, len(self.chosen) - 1)))

    def _find_part(self) -> tuple[Part | None, trimesh.Trimesh | None]:
        """The part with its mesh; None where it is no longer what was grasped."""
        info = self.attempts.infos[0]
        self._without_mesh = ""
        try:
            part = find_part(info.part)
        except BadPart as error:
            self._without_mesh = f"shown without its mesh: {error}"
            return None, None
        if part.content_hash != info.part_hash:
            self._without_mesh = f"shown without its mesh: '{part.name}' has changed since these attempts"
            return None, None
        return part, part_mesh(part)

    def _draw(self, number: int) -> None:
        scene, name, columns = self.page.scene, self._name, self.attempts.columns
        info = self.attempts.info(number)
        add_region(scene, f"{name}/region", info.region, info.table_z)
        T_base_obj = Pose.from_vector(columns["pose_base_obj"][number].astype(np.float64))
        grasp = columns["grasp"][number].astype(np.float64)
        if self.cloud.value:
            depth = self.attempts.depth(number)
            frame = RgbdFrame(
                colour=np.zeros((*depth.shape, 3), np.uint8), depth=depth, intrinsics=info.intrinsics,
                T_base_camera=info.T_base_camera, timestamp_s=0.0, serial=info.part,
            )  # fmt: skip
            points = seen_points(frame)
            drawn = drawn_points(points, info.region, info.table_z)
            add_cloud(scene, f"{name}/cloud", points[drawn], (120, 130, 145), pixel_pitch(frame))
        if self.hand.value:
            HandNode(scene, f"{name}/hand", opacity=0.6).place(pose_base_tcp(grasp))
        if self.mesh is not None and self.before.value:
            add_part(scene, f"{name}/before", self.mesh, T_base_obj)
        if self.mesh is not None and self.after.value and columns["success"][number]:
            held = Pose.from_vector(columns["pose_tcp_obj_after"][number].astype(np.float64))
            after = pose_base_tcp(grasp) @ held
            add_part(scene, f"{name}/after", self.mesh, after, colour=rgb(ORANGE), opacity=0.5)
        if self.others.value:
            self._draw_others(number, T_base_obj)
        self.text.content = attempt_text(columns, number, len(self.chosen), len(self.attempts))

    def _draw_others(self, number: int, T_base_obj: Pose) -> None:
        """Draw the grasps of the filter at parts that lay alike, where they were at this part."""
        same = self.chosen
        if self._lying is not None:
            same = same[self._lying[same] == self._lying[number]]
        columns = self.attempts.columns
        poses = Pose.from_vector(columns["pose_base_obj"][same].astype(np.float64))
        there = T_base_obj @ poses.inverse() @ pose_base_grasp(columns["grasp"][same].astype(np.float64))
        w, z = there.quat_wxyz[:, 0], there.quat_wxyz[:, 3]
        colours = np.where(columns["success"][same, None], rgb(GREEN), rgb(RED)).astype(np.uint8)
        grasps = Grasp(position=there.position, theta=2 * np.arctan2(z, w))
        add_closing_lines(self.page.scene, f"{self._name}/others", grasps, colours)


def attempt_text(columns: dict[str, np.ndarray], number: int, n_chosen: int, n_all: int) -> str:
    """An attempt in words, as Markdown."""
    outcome = FAILURES[columns["failure"][number]]
    if columns["success"][number]:
        tilt = np.degrees(columns["tilt"][number])
        outcome = f"lifted: {shift_text(columns['displacement'][number])}, tilt {tilt:.1f} deg"
    return f"attempt {columns['attempt'][number]}: **{outcome}**\n\n{n_chosen} of {n_all} attempts pass"


def shift_text(displacement: np.ndarray) -> str:
    """A displacement (4,) in words."""
    dx, dy, dz = 1e3 * np.asarray(displacement[:3], dtype=np.float64)
    return f"dx {dx:+z.1f}, dy {dy:+z.1f}, dz {dz:+z.1f} mm, turn {np.degrees(displacement[3]):+z.1f} deg"


def comparison_text(replay: Replay, stored: str, displacement: np.ndarray) -> str:
    """How a replay compares with the stored failure ("none": lifted) and displacement (4,), in words."""
    if replay.failure != stored:
        names = {FAILURES[0]: "lifted"}
        now, then = (names.get(one, one) for one in (replay.failure, stored))
        return f"simulated again: **{now}**, stored as {then}: a marginal grasp, or another simulation"
    if stored != FAILURES[0]:
        return f"simulated again: {stored}, as stored"
    off = 1e3 * float(np.linalg.norm(replay.displacement[:3] - displacement[:3]))
    return f"simulated again: lifted, as stored; {shift_text(replay.displacement)}, {off:.2f} mm from it"
