"""The ManiSkill task in a loop: random grasps of one part, and how far the part shifted.

python examples/maniskill_task.py [part] [number of attempts]
"""

import sys

import gymnasium
import numpy as np

from tasks import GraspDisplacementEnv  # importing it registers the task


def main(part: str, n: int) -> None:
    env = gymnasium.make("GraspDisplacement-v1", parts=[part], obs_mode="none")
    task = env.unwrapped
    assert isinstance(task, GraspDisplacementEnv)
    rng = np.random.default_rng(0)
    shifts = []
    for episode in range(n):
        env.reset(seed=episode)
        x, y, _ = task.part_pose().position[0].tolist()  # base frame, metres

        # One action is one grasp: x, y, z, theta; one step is the whole attempt.
        grasp = np.array([x, y, 0.012, 0.0]) + rng.normal(0, [0.004, 0.004, 0, 0.5])
        *_, info = env.step(grasp.astype(np.float32))
        if info["success"].item():
            dx, dy, dz, dtheta = np.asarray(info["displacement"])[0]
            shifts.append(np.linalg.norm([dx, dy, dz]))
            turn = np.degrees(dtheta)
            print(f"{episode}: lifted, shifted by {shifts[-1] * 1e3:.1f} mm, turned by {turn:.1f} degrees")
        else:
            print(f"{episode}: not lifted")
    env.close()
    if shifts:
        print(f"{len(shifts)} of {n} lifted, median shift {np.median(shifts) * 1e3:.1f} mm")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "hex_nut_m30", int(sys.argv[2]) if len(sys.argv) > 2 else 10)
