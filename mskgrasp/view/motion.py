"""A recorded motion of arm and part, and its playback in a panel."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import trimesh
from viser import GuiEvent

from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import forward_pose
from mskgrasp.view.page import Page, Panel
from mskgrasp.view.scene import STEEL, ArmNode, add_part, place

SPEEDS = {"1": 1.0, "1/2": 0.5, "1/5": 0.2}
"""Speeds of the playback, as shares of that of the motion."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A motion of the Panda and a part at n moments.

    Attributes:
        seconds: (n,) since the first moment.
        joints: (n, 7) radians.
        width: (n,) distance of the pads, metres.
        T_base_obj: The part's poses (n,).
    """

    seconds: np.ndarray
    joints: np.ndarray
    width: np.ndarray
    T_base_obj: Pose

    def at(self, seconds: float) -> int:
        """Index of the last moment that is no later than a time."""
        return max(0, int(np.searchsorted(self.seconds, seconds, side="right")) - 1)


class Player:
    """Nodes and controls of a motion in a panel, made within the panel's folder."""

    def __init__(self, page: Page, panel: Panel):
        self._page = page
        self._name = f"{panel.root.name}/motion"
        self._key = f"play {self._name}"
        self._motion: Motion | None = None
        self._started = 0.0
        self._controls = page.gui.add_folder("motion", visible=False)
        with self._controls:
            self.time = page.gui.add_slider("time, s", 0.0, 1.0, 0.02, 0.0)
            self.speed = page.gui.add_dropdown("speed", tuple(SPEEDS))
            self.play_button = page.gui.add_button("play")
        panel.on(self.time, self._draw)
        self.time.on_update(self._hold)
        panel.on(self.play_button, self.play)

    def load(self, motion: Motion, mesh: trimesh.Trimesh) -> None:
        """Take a motion in place of the last one, and play it."""
        self.clear()
        scene = self._page.scene
        self._nodes = scene.add_frame(self._name, show_axes=False)
        self._arm = ArmNode(scene, f"{self._name}/arm", PANDA_LINKS)
        self._part = add_part(scene, f"{self._name}/part", mesh, colour=STEEL)
        self._motion = motion
        self.time.max = float(motion.seconds[-1])
        self._controls.visible = True
        self.play()

    def clear(self) -> None:
        """Remove the motion, if there is one."""
        if self._motion is None:
            return
        self._page.main.repeat(self._key, None)
        self._motion = None
        self._nodes.remove()
        self._controls.visible = False

    def play(self) -> None:
        """Play the motion from its beginning."""
        self.time.value = 0.0
        self._draw()
        self._started = time.monotonic()
        self._page.main.repeat(self._key, self._advance)

    def _advance(self) -> None:
        if self._motion is None:
            return
        now = (time.monotonic() - self._started) * SPEEDS[self.speed.value]
        last = float(self._motion.seconds[-1])
        if now >= last:
            self._page.main.repeat(self._key, None)
        self.time.value = min(now, last)  # which draws it

    def _hold(self, event: GuiEvent) -> None:
        """End the playback where the user moves the slider, which playing moves as well."""
        if event.client is not None:
            self._page.main.repeat(self._key, None)

    def _draw(self) -> None:
        motion = self._motion
        if motion is None:
            return
        i = motion.at(self.time.value)
        poses = motion.T_base_obj
        with self._page.server.atomic():
            self._arm.place(motion.joints[i], forward_pose(motion.joints[i]), float(motion.width[i]))
            place(self._part, Pose(position=poses.position[i], quat_wxyz=poses.quat_wxyz[i]))
