"""A dataset as the networks see it: one patch and one action an attempt, split by parts."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from mskgrasp.dataset import Attempts, ShardInfo, list_shards, read_shard, u16_to_depth
from mskgrasp.errors import BadDataset, NoPartFound
from mskgrasp.finding import view_part
from mskgrasp.grasp import centre_in_grasp_frame, to_grasp_displacement
from mskgrasp.images import crop_patches, height_image
from mskgrasp.network_config import NetworkConfig
from mskgrasp.parts.catalogue import Split, read_index

HEIGHT_STEP = 1e-4
"""Metres; what depth is stored in."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """n attempts.

    Attributes:
        patches: (n, 1, r, c) int16, 0.1 mm above the table, each turned to its grasp.
        object_patches: (n, 1, r, c) int16, around the part and not turned; None where no network sees them.
        theta: (n,) float32 angle of the grasp.
        centre_grasp: (n, 3) float32 object centre, estimated from the image, in the grasp frame, metres.
        height: (n,) float32 of the grasp above the table, metres.
        success: (n,) bool.
        displacement: (n, 4) float32 true object displacement, NaN where the grasp failed.
        grasp_displacement: (n, 4) float32, the same as grasp displacement: what is learned.
        part: (n,) int64, index into ``parts``.
        parts: Names of the parts.
        skipped: Why and how many attempts could not be used: at run time, too, the planner would find
            no part in them.
        fingerprint: Hex digest of grasps and outcomes: two equal ones are the same data.
    """

    patches: Tensor
    object_patches: Tensor | None
    theta: Tensor
    centre_grasp: Tensor
    height: Tensor
    success: Tensor
    displacement: Tensor
    grasp_displacement: Tensor
    part: Tensor
    parts: tuple[str, ...]
    skipped: dict[str, int]
    fingerprint: str

    def __len__(self) -> int:
        return len(self.success)

    def patches_of(self, rows: Tensor, device: torch.device | str) -> Tensor:
        """Patches (n, 1, r, c) of some rows in metres on a device."""
        return self.patches[rows].to(device).float() * HEIGHT_STEP

    def quality_patches_of(self, rows: Tensor, device: torch.device | str, network: NetworkConfig) -> Tensor:
        """What the quality network sees of some rows, (n, 1, r, c) metres."""
        stride, columns = network.quality_stride, network.quality_shape[1]
        spare = (-(-self.patches.shape[-1] // stride) - columns) // 2
        coarse = self.patches[rows, :, ::stride, spare * stride :: stride][..., :columns]
        return coarse.to(device).float() * HEIGHT_STEP

    def displacement_patches_of(self, rows: Tensor, device: torch.device | str) -> Tensor:
        """What the displacement network sees of some rows, (n, 1, r, c) metres."""
        if self.object_patches is None:
            return self.patches_of(rows, device)
        return self.object_patches[rows].to(device).float() * HEIGHT_STEP

    def of_parts_between(self, low: float, high: float) -> Samples:
        """The samples of the parts of which a share in [low, high] of the grasps succeeded.

        Raises:
            BadDataset: No part is left.
        """
        rates = [float(self.success[self.part == i].float().mean()) for i in range(len(self.parts))]
        kept = [i for i, rate in enumerate(rates) if low <= rate <= high]
        if not kept:
            found = ", ".join(f"{rate:.0%}" for rate in sorted(rates))
            raise BadDataset(
                f"no part's success lies in {low:g}..{high:g} (found {found}); widen success_range"
            )
        rows = torch.isin(self.part, torch.tensor(kept, device=self.part.device))
        return replace(
            self,
            patches=self.patches[rows],
            object_patches=None if self.object_patches is None else self.object_patches[rows],
            theta=self.theta[rows],
            centre_grasp=self.centre_grasp[rows],
            height=self.height[rows],
            success=self.success[rows],
            displacement=self.displacement[rows],
            grasp_displacement=self.grasp_displacement[rows],
            part=torch.searchsorted(torch.tensor(kept, device=self.part.device), self.part[rows]),
            parts=tuple(self.parts[i] for i in kept),
        )


def read_samples(
    folder: Path,
    network: NetworkConfig,
    *,
    advance: Callable[[int, int], None] = lambda done, total: None,
) -> Samples:
    """Reads all shards of a dataset and crops every attempt's patch.

    Only the patches stay in memory (8 kB an attempt of 64 pixels), never the images of two shards.

    Args:
        folder: The dataset.
        network: What will learn from them: it decides the patches' size.
        advance: Called with the shards done and their number.

    Raises:
        BadDataset: A shard cannot be read, or no attempt shows a part.
    """
    paths = list_shards(folder)
    parts: list[str] = []
    skipped: Counter[str] = Counter()
    digest = hashlib.sha256()
    pieces = []
    for done, path in enumerate(paths):
        advance(done, len(paths))
        attempts, info = read_shard(path)
        if info.part not in parts:
            parts.append(info.part)
        for array in (attempts.grasp, attempts.success, attempts.displacement):
            digest.update(np.ascontiguousarray(array).tobytes())
        piece, missing = _shard_samples(attempts, info, network)
        skipped.update(missing)
        if piece is not None:
            pieces.append((*piece, torch.full((len(piece[0]),), parts.index(info.part))))
    advance(len(paths), len(paths))
    if not pieces:
        reason = f": {skipped.most_common(1)[0][0]}" if skipped else ""
        raise BadDataset(f"no usable attempt in {folder}{reason}; collect again")
    patches, object_patches, theta, centre, height, success, displacement, grasp_displacement, part = (
        torch.cat(arrays) for arrays in zip(*pieces, strict=True)
    )
    return Samples(
        patches=patches,
        object_patches=object_patches if network.image == "object" else None,
        theta=theta,
        centre_grasp=centre,
        height=height,
        success=success,
        displacement=displacement,
        grasp_displacement=grasp_displacement,
        part=part,
        parts=tuple(parts),
        skipped=dict(skipped),
        fingerprint=digest.hexdigest(),
    )


def _shard_samples(
    attempts: Attempts, info: ShardInfo, network: NetworkConfig
) -> tuple[tuple[Tensor, ...] | None, Counter[str]]:
    skipped: Counter[str] = Counter()
    depth = u16_to_depth(attempts.depth)
    rows, centres, offsets = [], [], []
    for row, image in enumerate(depth):
        try:
            view = view_part(
                image, info.intrinsics, info.T_base_camera, table_z=info.table_z, region=info.region
            )
        except NoPartFound as error:
            # The message without its numbers: what is counted is the reason.
            skipped[str(error).split(" (")[0]] += 1
            continue
        rows.append(row)
        centres.append(view.centre_base)
        offsets.append(view.table_offset)
    if not rows:
        return None, skipped
    grasp = attempts.grasp[rows].astype(np.float64)
    displacement = attempts.displacement[rows].astype(np.float64)
    centre_grasp = centre_in_grasp_frame(np.array(centres), grasp)
    table_z = info.table_z + np.array(offsets)
    heights = height_image(torch.from_numpy(depth[rows]), info.intrinsics, info.T_base_camera, table_z)

    def crop(planes: np.ndarray) -> Tensor:
        patches = crop_patches(
            heights,
            torch.from_numpy(planes),
            info.intrinsics,
            info.T_base_camera,
            n_pixels=network.patch_pixels,
            side=network.patch_side,
            n_columns=network.patch_columns,
        )
        return (patches / HEIGHT_STEP).round().clamp(-32768, 32767).to(torch.int16)

    around = np.column_stack([np.array(centres), np.zeros(len(rows))])
    return (
        crop(grasp),
        crop(around) if network.image == "object" else torch.zeros(len(rows), 0),
        torch.from_numpy(grasp[:, 3]).float(),
        torch.from_numpy(centre_grasp).float(),
        torch.from_numpy(grasp[:, 2] - info.table_z).float(),
        torch.from_numpy(attempts.success[rows]),
        torch.from_numpy(displacement).float(),
        torch.from_numpy(to_grasp_displacement(displacement, centre_grasp)).float(),
    ), skipped


def part_sides(parts: tuple[str, ...], fraction: float, by: Literal["name", "catalogue"]) -> dict[str, Split]:
    """The side of each part: training, validation, or test.

    A part stays on its side when other parts join the dataset. By name, at least one part is on either side.

    Args:
        parts: Names.
        fraction: Share of the validation parts, by name.
        by: A hash of the name; or the catalogue, which keeps near-duplicates together. Parts that are not in
            it are then split by name.

    Raises:
        BadDataset: There are fewer than two parts, or no catalogue.
    """
    if len(parts) < 2:
        raise BadDataset(
            f"the dataset has one part ({', '.join(parts)}), validation needs another that training never "
            "sees; collect at least 2 parts"
        )
    sides: dict[str, Split] = {
        name: "validation" if _name_hash(name) < fraction else "train" for name in parts
    }
    if by == "catalogue":
        index = read_index().parts
        if not index:
            raise BadDataset(
                "sides: catalogue needs the catalogue: python -m mskgrasp.parts build --catalogue"
            )
        sides |= {name: index[name].split for name in parts if name in index}
    order = sorted(parts, key=_name_hash)
    if "validation" not in sides.values():
        sides[order[0]] = "validation"
    if "train" not in sides.values():
        sides[order[-1]] = "train"
    return sides


def _name_hash(name: str) -> float:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2**64
