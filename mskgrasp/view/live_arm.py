"""Arm and part of a cell as they are now, also while the arm moves."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import trimesh

from hal import Cell, HalError
from hal.simulated import WATCH_S, SimulatedArm
from mskgrasp.core.geometry import Pose
from mskgrasp.view.main_thread import FRAME_S
from mskgrasp.view.page import Page
from mskgrasp.view.scene import ArmNode, add_part, place

POLL_S = 0.05
"""Time between two looks at a real arm in motion, s."""


class LiveArm:
    """Nodes of a cell's arm and part.

    Args:
        page: The page.
        name: Of the nodes' parent.
        cell: Connected. One that is recorded or replayed is asked nothing: a recording has no answers.
        mesh: Of the part, which is drawn where the cell tracks it; None: not known.
    """

    def __init__(self, page: Page, name: str, cell: Cell, mesh: trimesh.Trimesh | None):
        self._page, self._cell = page, cell
        self._arm = ArmNode(page.scene, f"{name}/arm", cell.arm.links)
        self._arm.node.visible = not cell.recorded
        self._part = None
        if mesh is not None and cell.tracker is not None and not cell.recorded:
            self._part = add_part(page.scene, f"{name}/part", mesh)
        self._seen = self._due = 0.0

    def part_pose(self) -> Pose | None:
        """``T_base_obj`` by the cell's tracker; None where it has none."""
        tracker = self._cell.tracker
        return None if tracker is None or self._cell.recorded else tracker.part_pose()

    def look(self) -> None:
        """Draw arm and part as they are.

        Raises:
            HalError: The arm is lost.
        """
        if self._cell.recorded:
            return
        self._seen = time.monotonic()
        state, pose = self._cell.arm.state(), self.part_pose()
        with self._page.server.atomic():
            self._arm.place(state.joints, state.T_base_tcp, state.gripper_width)
            if self._part is not None and pose is not None:
                place(self._part, pose)

    @contextmanager
    def in_motion(self) -> Iterator[None]:
        """Keep drawing while the block moves the arm; a simulated motion takes as long as a real one."""
        arm = self._cell.arm
        if self._cell.recorded:
            yield
        elif isinstance(arm, SimulatedArm):
            self._due = time.monotonic()
            arm.watch(self._passed)
            try:
                yield
            finally:
                arm.watch(None)
                self.look()
        else:
            over = threading.Event()
            looking = threading.Thread(target=self._poll, args=(over,), daemon=True)
            looking.start()
            try:
                yield
            finally:
                over.set()
                looking.join()

    def _passed(self) -> None:
        """Look at a simulated arm, and wait where the simulation is faster than the motion is."""
        if time.monotonic() - self._seen >= FRAME_S:
            self.look()
        self._due += WATCH_S
        now = time.monotonic()
        if self._due > now:
            time.sleep(self._due - now)
        else:
            self._due = now  # time that a slow simulation has lost is not made up for

    def _poll(self, over: threading.Event) -> None:
        """Look at a real arm, whose state any thread may read, until the motion is over."""
        while not over.wait(POLL_S):
            try:
                self.look()
            except HalError:
                return  # the main thread, which commands the motion, meets it, too
