"""Read a dataset with numpy and with torch.

python -m mskgrasp.collect --out data/demo && python examples/read_dataset.py data/demo
"""

import sys

import numpy as np
import torch
from torch.utils.data import DataLoader, TensorDataset

from mskgrasp import open_dataset


def main(folder: str) -> None:
    dataset = open_dataset(folder)
    table = dataset.columns("grasp", "success", "displacement", "tilt")
    lifted = table["success"]
    print(f"{len(lifted)} attempts at {len(dataset.part_names)} parts, {lifted.mean():.0%} lifted")

    # Displacement is NaN where the part was not lifted: dx, dy, dz in metres, dtheta in radians.
    shift = np.linalg.norm(table["displacement"][lifted, :3], axis=1)
    print(f"median shift {np.median(shift) * 1e3:.1f} mm, 95 % under {np.quantile(shift, 0.95) * 1e3:.1f} mm")
    for name in dataset.part_names:
        rows = table["part"] == name
        print(f"  {name}: {lifted[rows].mean():.0%} of {rows.sum()}")

    # Depth images, shard by shard: uint16 in steps of 0.1 mm, 0 where invalid.
    attempts, info = next(dataset.shards())
    depth = attempts.depth.astype(np.float32) * 1e-4
    print(f"{info.part}: images {depth.shape[1:]}, camera at {info.T_base_camera.position}")

    batches = DataLoader(
        TensorDataset(torch.from_numpy(table["grasp"]), torch.from_numpy(lifted)),
        batch_size=32,
        shuffle=True,
        generator=torch.Generator().manual_seed(0),
    )
    grasps, success = next(iter(batches))
    print(f"a batch of {len(grasps)} grasps for torch, {int(success.sum())} of them lifted")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "data/demo")
