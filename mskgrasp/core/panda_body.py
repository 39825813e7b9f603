"""Masses of the Panda's hand, and the outline of arm and hand as capsules, for collision checks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import DH_A, DH_D, FLANGE_OFFSET, TCP_OFFSET, joint_frames, solve, track

HAND_MASS = 0.73
"""Mass of the Franka Hand with its fingers, kg (Desk's entry "Franka Hand")."""
HAND_CENTRE = (-0.01, 0.0, 0.03)
"""Its centre of mass in the flange, metres (the same)."""
PAYLOAD = 3.0
"""Greatest payload of a Panda or FR3, hand included, kg (data sheets)."""


@dataclass(frozen=True, kw_only=True)
class LinkCapsule:
    """A capsule fixed to one of the arm's moving frames.

    Attributes:
        name: Part of the arm, for messages.
        frame: 0 to 6: the frame of joint 1 to 7; 7: the tcp.
        ends: (2, 3) ends of its axis in that frame, metres.
        radius: Metres.
        over_table: It is checked against the table; the hand is by its corners (`hal.limits`), and what
            stands on the table is not.
    """

    name: str
    frame: int
    ends: tuple[tuple[float, float, float], tuple[float, float, float]]
    radius: float
    over_table: bool = False


_CAPSULES = (
    LinkCapsule(name="shoulder", frame=0, ends=((0, -0.008, -0.164), (0, -0.04, -0.012)), radius=0.071),
    LinkCapsule(name="shoulder", frame=0, ends=((0, -0.033, 0.032), (0, -0.086, -0.034)), radius=0.072),
    LinkCapsule(name="upper arm", frame=1, ends=((0, -0.013, 0.005), (0, -0.011, 0.069)), radius=0.073),
    LinkCapsule(name="upper arm", frame=1, ends=((0, -0.015, 0.053), (0, -0.154, 0)), radius=0.072),
    LinkCapsule(
        name="elbow", frame=2, ends=((0.005, 0.013, -0.1), (0.033, 0.007, -0.028)), radius=0.073,
        over_table=True,
    ),
    LinkCapsule(
        name="elbow", frame=2, ends=((0.085, 0.016, -0.013), (0.074, 0.066, -0.018)), radius=0.073,
        over_table=True,
    ),
    LinkCapsule(
        name="elbow", frame=3, ends=((0, 0.016, 0.007), (-0.015, 0.015, 0.071)), radius=0.075,
        over_table=True,
    ),
    LinkCapsule(
        name="elbow", frame=3, ends=((-0.115, 0.035, -0.012), (-0.067, 0.101, 0.011)), radius=0.075,
        over_table=True,
    ),
    LinkCapsule(
        name="forearm", frame=4, ends=((0, 0.01, -0.238), (0, 0.045, -0.093)), radius=0.070, over_table=True
    ),
    LinkCapsule(
        name="forearm", frame=4, ends=((0, 0.044, -0.086), (0, 0.065, 0.011)), radius=0.069, over_table=True
    ),
    LinkCapsule(
        name="wrist", frame=5, ends=((-0.021, 0.029, -0.003), (0.02, -0.011, 0.017)), radius=0.061,
        over_table=True,
    ),
    LinkCapsule(
        name="wrist", frame=5, ends=((0.079, -0.024, -0.001), (0.073, 0.048, 0.01)), radius=0.062,
        over_table=True,
    ),
    LinkCapsule(
        name="wrist", frame=6, ends=((-0.005, -0.006, 0.072), (0.008, 0.01, 0.078)), radius=0.051,
        over_table=True,
    ),
    LinkCapsule(
        name="wrist", frame=6, ends=((0.043, 0.039, 0.079), (0.043, 0.039, 0.079)), radius=0.050,
        over_table=True,
    ),
    # The hand's frame is TCP_OFFSET before the tcp.
    LinkCapsule(name="hand", frame=7, ends=((0, -0.075, -0.0974), (0, 0.074, -0.0944)), radius=0.035),
    LinkCapsule(name="hand", frame=7, ends=((0, -0.082, -0.0634), (0, 0.079, -0.0634)), radius=0.035),
    # Fingers at any opening: 66 mm to either side, 11 mm wide, down to 9.5 mm under the tcp.
    LinkCapsule(name="fingers", frame=7, ends=((0, -0.056, -0.03), (0, 0.056, -0.03)), radius=0.02),
    LinkCapsule(name="fingers", frame=7, ends=((0, -0.056, -0.0075), (0, 0.056, -0.0075)), radius=0.02),
)  # fmt: skip
"""Fitted to the collision meshes of franka_description, which lie inside them; of each link two, as Franka's
own capsules for self-collision leave up to 3 cm of a link uncovered."""


@dataclass(frozen=True, kw_only=True)
class Links:
    """Capsules of an arm and the kinematics that move them."""

    capsules: tuple[LinkCapsule, ...]

    @property
    def radii(self) -> np.ndarray:
        """(m,) radii of the capsules, metres."""
        return np.array([one.radius for one in self.capsules])

    def segments(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the capsules' axes at joints (..., 7), radians.

        Returns:
            Two arrays (..., m, 3), base frame, metres.
        """
        frames = np.stack(joint_frames(joints), axis=-3)[..., [one.frame for one in self.capsules], :, :]
        ends = np.array([one.ends for one in self.capsules])
        first, second = (
            (frames[..., :3, :3] @ ends[:, i, :, None])[..., 0] + frames[..., :3, 3] for i in (0, 1)
        )
        return first, second

    def reach(self) -> np.ndarray:
        """(7, m) bound of the distance by which a capsule moves per radian of each joint, metres."""
        steps = [*np.hypot(DH_A, DH_D), FLANGE_OFFSET + TCP_OFFSET]
        bounds = np.zeros((7, len(self.capsules)))
        for number, one in enumerate(self.capsules):
            extent = max(float(np.linalg.norm(end)) for end in one.ends) + one.radius
            for joint in range(min(one.frame, 6) + 1):
                bounds[joint, number] = sum(steps[joint + 1 : one.frame + 1]) + extent
        return bounds

    def joints_at(self, T_base_tcp: Pose) -> np.ndarray:
        """(7,) joints at which the hand is at a pose that is in reach: elbow up."""
        return solve(T_base_tcp)[0]

    def joints_along(self, line: Pose, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Joints along a line of poses (k,), from joints (7,): `mskgrasp.core.panda_kinematics.track`."""
        return track(line.as_matrix(), start)


PANDA_LINKS = Links(capsules=_CAPSULES)
"""The Panda, or the FR3, with the Franka Hand."""
