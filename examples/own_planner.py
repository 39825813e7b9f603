"""A planner of your own for the benchmark: a Python object with ``plan(frame, rng)``.

An installed package names `make_planner` as an entry point of the group ``mskgrasp.planners``:

    [project.entry-points."mskgrasp.planners"]
    highest = "own_planner:make_planner"

python -m mskgrasp.benchmark --quick --planners highest ours
"""

import numpy as np

from mskgrasp import Grasp
from mskgrasp.core.errors import NoGraspFound
from mskgrasp.planning.proposal import ProposedGrasp


class HighestPointPlanner:
    """Closes the fingers on the highest point of the part."""

    def __init__(self, workspace):
        self.workspace = workspace

    def plan(self, frame, rng):
        rows, columns = np.indices(frame.depth.shape)
        rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame.intrinsics).T
        points = frame.T_base_camera.apply((rays * frame.depth[..., None]).reshape(-1, 3))  # (n, 3), metres
        heights = np.nan_to_num(points[:, 2] - self.workspace.table_z)
        if heights.max() < self.workspace.min_height:
            raise NoGraspFound("the table is empty")
        x, y, top = points[heights.argmax()]
        z = max(top - 0.01, self.workspace.lowest_grasp_z(np.array([x, y])))
        grasp = Grasp(position=np.array([x, y, z]), theta=rng.uniform(-np.pi / 2, np.pi / 2))
        # quality, displacement (4,) and displacement_cov (4, 4) may be left out: no quality, and zero.
        return ProposedGrasp(grasp=grasp, quality=0.5, displacement=np.zeros(4))


def make_planner(workspace):
    return HighestPointPlanner(workspace)
