"""Training samples of a dataset: a patch and an action for each attempt, and the split by parts."""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.errors import BadDataset, NoPartFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import (
    FAILURES,
    centre_in_grasp_frame,
    pose_base_grasp,
    swing_in_hand,
    to_grasp_displacement,
)
from mskgrasp.dataset import Attempts, ShardInfo, list_shards, read_shard, u16_to_depth
from mskgrasp.dataset.fingerprint import OUTCOMES
from mskgrasp.dataset.shards import require_own_name
from mskgrasp.learning.label_source import LabelSource, distinct, source_of
from mskgrasp.learning.network_config import NetworkConfig
from mskgrasp.perception.height_patches import crop_patches, height_image
from mskgrasp.perception.part_detection import view_part
from mskgrasp.runtime.worker_pool import Work, process_count, results

SAMPLES_VERSION = 3
"""Raised by every change after which a dataset gives other samples: training does not resume with them."""
HEIGHT_STEP = 1e-4
"""Resolution of stored patches, metres: that of a stored depth."""
SHARDS_A_WORKER = 100
"""Fewer are read faster than another process starts: a shard of 40 attempts takes 60 ms, a start 4 s."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Samples of n attempts.

    Attributes:
        patches: (n, 1, r, c) int16, 0.1 mm above the table, each rotated with its grasp.
        object_patches: (n, 1, r, c) int16, centred on the part and not rotated; None unless the
            network sees them.
        theta: (n,) float32 angle of the grasp.
        centre_grasp: (n, 3) float32 object centre, estimated from the image, in the grasp frame, metres:
            the networks' input for the part's position.
        origin_grasp: (n, 3) float32 the part's true centroid, the origin of obj, in the grasp frame, metres.
        quat_grasp_obj: (n, 4) float32 wxyz, the part's true orientation in the grasp frame.
        height: (n,) float32 of the grasp above the table, metres.
        success: (n,) bool.
        displacement: (n, 4) float32 true displacement of the centroid, NaN where the grasp failed.
        grasp_displacement: (n, 4) float32, the same motion as grasp displacement: the training target.
        swing: (n, 2) float32 swing of the part in the hand, radians about x and y of the grasp frame, NaN
            where the grasp failed.
        part: (n,) int64, index into ``parts``.
        planned: (n,) bool, whether a planner chose the grasp; the others are random.
        parts: Names of the parts.
        skipped: Number of unusable attempts by reason: the planner would find no part in them either, or the
            part was not at rest.
        fingerprint: Hex digest of grasps and outcomes; images and poses do not enter it.
        sources: Simulations and settings that the labels come from; a sound dataset has one.
    """

    patches: Tensor
    object_patches: Tensor | None
    theta: Tensor
    centre_grasp: Tensor
    origin_grasp: Tensor
    quat_grasp_obj: Tensor
    height: Tensor
    success: Tensor
    displacement: Tensor
    grasp_displacement: Tensor
    swing: Tensor
    part: Tensor
    planned: Tensor
    parts: tuple[str, ...]
    skipped: dict[str, int]
    fingerprint: str
    sources: tuple[LabelSource, ...] = ()

    def __len__(self) -> int:
        return len(self.success)

    def on(self, device: torch.device | str) -> Samples:
        """The same samples with every array on a device."""
        moved = {name: values.to(device) for name, values in vars(self).items() if isinstance(values, Tensor)}
        return replace(self, **moved)

    def patches_of(self, rows: Tensor, device: torch.device | str) -> Tensor:
        """Get patches (n, 1, r, c) of some rows in metres on a device."""
        return self.patches[rows].to(device).float() * HEIGHT_STEP

    def quality_patches_of(self, rows: Tensor, device: torch.device | str, network: NetworkConfig) -> Tensor:
        """Get the quality network's patches of some rows, (n, 1, r, c) metres."""
        stride, columns = network.quality_stride, network.quality_shape[1]
        spare = (-(-self.patches.shape[-1] // stride) - columns) // 2
        coarse = self.patches[rows, :, ::stride, spare * stride :: stride][..., :columns]
        return coarse.to(device).float() * HEIGHT_STEP

    def displacement_patches_of(self, rows: Tensor, device: torch.device | str) -> Tensor:
        """Get the displacement network's patches of some rows, (n, 1, r, c) metres."""
        if self.object_patches is None:
            return self.patches_of(rows, device)
        return self.object_patches[rows].to(device).float() * HEIGHT_STEP

    def targets(self, rows: Tensor, network: NetworkConfig) -> Tensor:
        """Get the displacement network's targets (n, k): grasp displacement, and swing if it predicts it."""
        target = self.grasp_displacement[rows]
        return torch.cat([target, self.swing[rows]], dim=1) if network.swing else target

    def random_of(self, rows: Tensor) -> Tensor:
        """Those of some rows whose grasps are random, not a planner's."""
        return rows[~self.planned[rows]]

    def of_parts_between(self, low: float, high: float) -> Samples:
        """Select the parts whose success rate lies in [low, high].

        Raises:
            BadDataset: No part has such a rate.
        """
        rates = [float(self.success[self.part == i].double().mean()) for i in range(len(self.parts))]
        kept = [i for i, rate in enumerate(rates) if low <= rate <= high]
        if not kept:
            found = ", ".join(f"{rate:.0%}" for rate in sorted(rates) if not math.isnan(rate))
            raise BadDataset(
                f"no part's success lies in {low:g}..{high:g} (found {found}); widen success_range"
            )
        rows = torch.isin(self.part, torch.tensor(kept, device=self.part.device))
        chosen = {name: values[rows] for name, values in vars(self).items() if isinstance(values, Tensor)}
        chosen["part"] = torch.searchsorted(torch.tensor(kept, device=self.part.device), chosen["part"])
        return replace(self, **chosen, parts=tuple(self.parts[i] for i in kept))

    def joined(self, other: Samples) -> Samples:
        """Add the samples of another dataset at these parts; those of other parts are left out.

        ``skipped`` and ``sources`` are those of both datasets as a whole.

        Raises:
            BadDataset: It has none of these parts.
        """
        number = {name: index for index, name in enumerate(self.parts)}
        own = torch.tensor([number.get(name, -1) for name in other.parts], device=other.part.device)[
            other.part
        ]
        rows = own >= 0
        if not rows.any():
            raise BadDataset("no planned attempt is at a part of --data within success_range; collect some")
        arrays = {
            name: torch.cat([values, own[rows] if name == "part" else getattr(other, name)[rows]])
            for name, values in vars(self).items()
            if isinstance(values, Tensor)
        }
        return replace(
            self,
            **arrays,
            skipped=dict(Counter(self.skipped) + Counter(other.skipped)),
            fingerprint=joined_fingerprint(self.fingerprint, other.fingerprint),
            sources=distinct((*self.sources, *other.sources)),
        )


def joined_fingerprint(one: str, other: str) -> str:
    """Digest of two datasets that are learned together, from that of each."""
    return hashlib.sha256(f"{one}{other}".encode()).hexdigest()


def read_samples(
    folder: Path,
    network: NetworkConfig,
    *,
    advance: Callable[[int, int], None] = lambda done, total: None,
    workers: int | None = None,
) -> Samples:
    """Read all shards of a dataset and crop every attempt's patch.

    Only the patches stay in memory (8 kB for an attempt of 64 x 64 pixels), and the images of one shard for
    each process. The samples do not depend on the number of processes.

    Args:
        folder: The dataset.
        network: Gives the patches' size and resolution.
        advance: Called with the shards done and their number.
        workers: Processes; None: one for each core, if there are enough shards.

    Raises:
        BadDataset: A shard cannot be read, is there twice, or no attempt shows a part.
    """
    paths = list_shards(folder)
    if workers is None:
        workers = min(process_count(), max(1, len(paths) // SHARDS_A_WORKER))
    work = Work(_reader, network, name=lambda job: f"reading {job[1]}")
    pieces: dict[int, _Piece] = {}
    advance(0, len(paths))
    with contextlib.closing(results(work, list(enumerate(paths)), workers)) as found:
        for index, piece in found:
            if isinstance(piece, BadDataset):
                raise piece
            pieces[index] = piece
            advance(len(pieces), len(paths))
    in_order = [pieces[index] for index in range(len(paths))]
    _refuse_copies(paths, in_order)
    return _joined(in_order, folder, network)


def _refuse_copies(paths: Sequence[Path], pieces: Sequence[_Piece]) -> None:
    known: dict[bytes, Path] = {}
    for path, piece in zip(paths, pieces, strict=True):
        other = known.setdefault(piece.raw, path)
        if piece.raw and other != path:
            raise BadDataset(f"{path} holds the same attempts as {other.name}; delete one of them")


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """Samples of one shard, as plain arrays that processes can exchange.

    Attributes:
        part: Name of its part.
        raw: Bytes that enter the fingerprint.
        arrays: By the names of the samples' attributes; empty if no attempt shows a part.
        skipped: Number of unusable attempts by reason.
        source: Where its labels come from.
    """

    part: str
    raw: bytes
    arrays: dict[str, np.ndarray]
    skipped: dict[str, int]
    source: LabelSource


@contextlib.contextmanager
def _reader(
    network: NetworkConfig,
) -> Iterator[Callable[[tuple[int, Path]], Iterator[tuple[int, _Piece | BadDataset]]]]:
    """Make a reader of shards; it yields an error as a result, so that its type survives the worker pool."""

    def read(job: tuple[int, Path]) -> Iterator[tuple[int, _Piece | BadDataset]]:
        index, path = job
        try:
            attempts, info = read_shard(path)
            require_own_name(path, info)
            source = source_of(info)
        except BadDataset as error:
            yield index, error
            return
        outcomes = [getattr(attempts, name) for name in OUTCOMES]
        arrays, skipped = _shard_samples(attempts, info, network)
        yield (
            index,
            _Piece(
                part=info.part,
                raw=b"".join(np.ascontiguousarray(array).tobytes() for array in outcomes),
                arrays=arrays,
                skipped=dict(skipped),
                source=source,
            ),
        )

    yield read


def _joined(pieces: list[_Piece], folder: Path, network: NetworkConfig) -> Samples:
    skipped: Counter[str] = Counter()
    for piece in pieces:
        skipped.update(piece.skipped)
    parts = tuple(dict.fromkeys(piece.part for piece in pieces))
    digest = hashlib.sha256(b"".join(piece.raw for piece in pieces)).hexdigest()
    usable = [piece for piece in pieces if piece.arrays]
    if not usable:
        reason = f": {skipped.most_common(1)[0][0]}" if skipped else ""
        raise BadDataset(f"no usable attempt in {folder}{reason}; collect again")
    number = {name: index for index, name in enumerate(parts)}
    arrays = {
        name: torch.from_numpy(np.concatenate([piece.arrays[name] for piece in usable]))
        for name in usable[0].arrays
    }
    object_patches = arrays.pop("object_patches")
    return Samples(
        **arrays,
        object_patches=object_patches if network.sees_object else None,
        part=torch.cat([torch.full((len(piece.arrays["success"]),), number[piece.part]) for piece in usable]),
        parts=parts,
        skipped=dict(skipped),
        fingerprint=digest,
        sources=distinct(piece.source for piece in pieces),
    )


def _shard_samples(
    attempts: Attempts, info: ShardInfo, network: NetworkConfig
) -> tuple[dict[str, np.ndarray], Counter[str]]:
    skipped: Counter[str] = Counter()
    depth = u16_to_depth(attempts.depth)
    rows, centres, offsets = [], [], []
    for row, image in enumerate(depth):
        if FAILURES[attempts.failure[row]] == "unsettled":
            skipped["the part was not at rest"] += 1
            continue
        try:
            view = view_part(
                image, info.intrinsics, info.T_base_camera, table_z=info.table_z, region=info.region
            )
        except NoPartFound as error:
            # The message without its numbers is the reason, which is counted.
            skipped[str(error).split(" (")[0]] += 1
            continue
        rows.append(row)
        centres.append(view.centre_base)
        offsets.append(view.table_offset)
    if not rows:
        return {}, skipped
    grasp = attempts.grasp[rows].astype(np.float64)
    displacement = attempts.displacement[rows].astype(np.float64)
    before, after = (
        Pose.from_vector(poses[rows].astype(np.float64))
        for poses in (attempts.pose_tcp_obj_before, attempts.pose_tcp_obj_after)
    )
    T_base_obj = Pose.from_vector(attempts.pose_base_obj[rows].astype(np.float64))
    T_grasp_obj = pose_base_grasp(grasp).inverse() @ T_base_obj
    origin_grasp = T_grasp_obj.position
    table_z = info.table_z + np.array(offsets)
    heights = height_image(torch.from_numpy(depth[rows]), info.intrinsics, info.T_base_camera, table_z)

    def crop(planes: np.ndarray) -> np.ndarray:
        patches = crop_patches(
            heights,
            torch.from_numpy(planes),
            info.intrinsics,
            info.T_base_camera,
            n_pixels=network.patch_pixels,
            side=network.patch_side,
            n_columns=network.patch_shape[1],
        )
        return (patches / HEIGHT_STEP).round().clamp(-32768, 32767).to(torch.int16).numpy()

    around_part = np.column_stack([np.array(centres), np.zeros(len(rows))])
    return {
        "patches": crop(grasp),
        "object_patches": crop(around_part) if network.sees_object else np.zeros((len(rows), 0)),
        "theta": grasp[:, 3].astype(np.float32),
        "centre_grasp": centre_in_grasp_frame(np.array(centres), grasp).astype(np.float32),
        "origin_grasp": origin_grasp.astype(np.float32),
        "quat_grasp_obj": T_grasp_obj.quat_wxyz.astype(np.float32),
        "height": (grasp[:, 2] - info.table_z).astype(np.float32),
        "success": attempts.success[rows],
        "displacement": displacement.astype(np.float32),
        "grasp_displacement": to_grasp_displacement(displacement, origin_grasp).astype(np.float32),
        "swing": swing_in_hand(before, after).astype(np.float32),
        "planned": np.full(len(rows), bool(info.planner)),
    }, skipped
