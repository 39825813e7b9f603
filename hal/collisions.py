"""Distances of an arm's links from table and keep-outs along a motion. Pure functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hal.errors import OutOfWorkspace
from hal.limits import ArmLimits, plane_height, shown
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from mskgrasp.core.panda_body import Links
from mskgrasp.core.panda_kinematics import POSE_TOLERANCE

MARGIN = 0.02
"""Least distance of a link from a keep-out, metres: robots leave their planned path by millimetres, and what
stands in a cell is measured by tape."""
TABLE_MARGIN = 0.01
"""Least distance of forearm, wrist and elbow from the table, metres."""
RESOLUTION = 0.005
"""Greatest amount by which a link may come nearer between two checked points of a motion, metres."""
_SLACK = 1e-3
"""Tolerance of an arm that stands too near already, metres: it rests as exactly as its drives hold it."""
_AT_LIMIT = 1e-3
"""Tolerance of an arm that stands at a joint's limit, rad."""
_LINE_M, _LINE_RAD = 0.04, 0.1
"""Steps at which the joints of a straight line are solved; between them the hand is off it by 0.5 mm."""
_FINER = 4


@dataclass(frozen=True, kw_only=True)
class Clearances:
    """Pairs of a link's capsule and what it keeps away from.

    Attributes:
        links: The arm's links.
        limits: Table and keep-outs.
        pairs: (p,) index of a capsule and of a keep-out, or -1 for the table.
        required: (p,) least distances, metres.
    """

    links: Links
    limits: ArmLimits
    pairs: tuple[tuple[int, int], ...]
    required: np.ndarray

    @classmethod
    def of(cls, links: Links, limits: ArmLimits) -> Clearances:
        """All pairs of an arm and its limits."""
        capsules = links.capsules
        pairs = [(i, -1) for i, one in enumerate(capsules) if one.over_table]
        required = [TABLE_MARGIN] * len(pairs)
        for k in range(len(limits.keep_out)):
            pairs += [(i, k) for i in range(len(capsules))]
            required += [MARGIN] * len(capsules)
        return cls(links=links, limits=limits, pairs=tuple(pairs), required=np.array(required))

    def at(self, joints: np.ndarray) -> np.ndarray:
        """Distances (k, p) at joints (k, n), metres; negative where they overlap."""
        limits, radii = self.limits, self.links.radii
        first, second = self.links.segments(joints)
        over = [i for i, k in self.pairs if k < 0]
        ends = np.stack([first[:, over], second[:, over]])
        table = plane_height(ends[..., :2], limits.table_z, limits.table_slope, limits.table_centre)
        found = [(ends[..., 2] - table).min(axis=0) - radii[over]]
        found += [one.distance(first, second) - radii for one in limits.keep_out]
        return np.concatenate(found, axis=-1)

    def reach(self) -> np.ndarray:
        """(7, p) bound of the distance by which a pair's capsule moves per radian of a joint, metres."""
        return self.links.reach()[:, [i for i, _ in self.pairs]]

    def words(self, pair: int, distance: float) -> str:
        """A pair and its distance for messages."""
        capsule, other = self.pairs[pair]
        obstacle = "the table" if other < 0 else f"'{self.limits.keep_out[other].name}'"
        name = self.links.capsules[capsule].name
        if distance < 0:
            return f"the {name} {-distance * 1e3:.0f} mm into {obstacle}"
        return f"the {name} within {distance * 1e3:.0f} mm of {obstacle}"


def check_joints(links: Links, limits: ArmLimits, joints: np.ndarray, *, margin: float | None = None) -> None:
    """Refuse joints (n,) at which a link is too near to table or keep-out.

    Args:
        links: The arm's links.
        limits: Table and keep-outs.
        joints: (n,) radians.
        margin: Least distance, metres; None: `MARGIN` and `TABLE_MARGIN`.

    Raises:
        OutOfWorkspace: Names link, obstacle and distance.
    """
    clearances = Clearances.of(links, limits)
    required = clearances.required if margin is None else np.full(len(clearances.pairs), margin)
    distance = clearances.at(np.asarray(joints, dtype=np.float64)[None])[0]
    worst = int(np.argmin(distance - required))
    if distance[worst] < required[worst]:
        least = f" (at least {required[worst] * 1e3:.0f} mm)" if required[worst] > 0 else ""
        raise OutOfWorkspace(f"this would bring {clearances.words(worst, distance[worst])}{least}")


def check_path(links: Links, limits: ArmLimits, path: np.ndarray, what: str) -> None:
    """Refuse a path on which a link comes too near to table or keep-out.

    Between two checked points a link comes nearer by at most half of what it moves. The path is halved until
    that is ruled out, so that nothing is passed through. An arm that stands too near may move away, but come
    no nearer.

    Args:
        links: The arm's links.
        limits: Table and keep-outs.
        path: (k, n) joints, passed in straight lines of joint space, radians.
        what: The motion in words.

    Raises:
        OutOfWorkspace: Names link, obstacle and distance.
    """
    clearances = Clearances.of(links, limits)
    reach = clearances.reach()
    distances = clearances.at(path)
    required = np.minimum(clearances.required, distances[0] - _SLACK)
    begin, end, near, far = path[:-1], path[1:], distances[:-1], distances[1:]
    while True:
        _, pair = worst = np.unravel_index(int(np.argmin(distances - required)), distances.shape)
        if distances[worst] < required[pair]:
            least = clearances.required[pair] * 1e3
            raise OutOfWorkspace(
                f"{what} brings {clearances.words(int(pair), float(distances[worst]))} (at least "
                f"{least:.0f} mm); move there in steps around it, or correct workspace.keep_out"
            )
        moved = np.abs(end - begin) @ reach
        unsure = ((near + far - moved) / 2 < required - RESOLUTION).any(axis=1)
        if not unsure.any():
            return
        begin, end, near, far = begin[unsure], end[unsure], near[unsure], far[unsure]
        middle = (begin + end) / 2
        distances = clearances.at(middle)
        begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        near, far = np.concatenate([near, distances]), np.concatenate([distances, far])


def line_joints(links: Links, limits: ArmLimits, start: np.ndarray, here: Pose, goal: Pose) -> np.ndarray:
    """Joints (k, n) along the straight line from ``here``, where the joints are ``start`` (n,), to a pose.

    Raises:
        OutOfWorkspace: The arm does not reach all of it within its joint limits.
    """
    lower, upper = limits.joint_lower - _AT_LIMIT, limits.joint_upper + _AT_LIMIT
    distance, angle = pose_distance(here, goal)
    n = max(1, int(np.ceil(max(distance / _LINE_M, angle / _LINE_RAD))))
    for steps in (n, _FINER * n):
        line = straight_line(here, goal, np.linspace(0, 1, steps + 1)[1:])
        joints, errors = links.joints_along(line, start)
        if errors.max() < POSE_TOLERANCE and ((lower <= joints) & (joints <= upper)).all():
            return np.concatenate([start[None], joints])
    raise OutOfWorkspace(
        f"no straight line from here to TCP {shown(goal.position)} m within the joint limits; move to other "
        "joints first"
    )
