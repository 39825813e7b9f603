"""A planner as a program, in any language: it reads frames from npz files and answers in JSON, line by line.

python -m mskgrasp.benchmark --quick --program "python examples/planner_program.py" --planners program ours
"""

import json
import sys

import numpy as np


def plan(path, seed):
    frame = np.load(path)
    depth = frame["depth"]  # (h, w) metres along the optical axis, NaN where the camera sees nothing
    rows, columns = np.indices(depth.shape)
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame["intrinsics"]).T
    T_base_camera = frame["T_base_camera"]  # (4, 4); the camera's z points away from it
    points = (rays * depth[..., None]).reshape(-1, 3) @ T_base_camera[:3, :3].T + T_base_camera[:3, 3]
    heights = np.nan_to_num(points[:, 2] - frame["table_z"])
    part = points[heights > frame["min_height"]]
    if not len(part):
        return {"refused": "the table is empty"}
    x, y = part[:, :2].mean(axis=0)
    z = max(frame["table_z"] + heights.max() / 2, frame["table_z"] + 0.0105)
    theta = np.random.default_rng(seed).uniform(-np.pi / 2, np.pi / 2)
    # Also legal: "quality", "displacement" (4 numbers), "displacement_cov" (4 x 4), "point_base" (3).
    return {"grasp": [float(x), float(y), float(z), float(theta)], "quality": 0.5}


for line in sys.stdin:
    request = json.loads(line)
    print(json.dumps(plan(request["frame"], request["seed"])), flush=True)
