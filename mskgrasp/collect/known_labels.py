"""Labels that a collection is given: what grasps they are of, and which of its parts they hold."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mskgrasp.collect.config import SUCCESS_IS_OF_RANDOM, CollectConfig
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.dataset import ShardInfo
from mskgrasp.dataset.labels import ShardLabels
from mskgrasp.parts import Part
from mskgrasp.runtime.progress import note
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import SIMULATION_VERSION


def chosen_by(config: CollectConfig, known: Mapping[tuple[str, int], ShardLabels]) -> str:
    """Digest of the planner that chooses the grasps, or that chose those of the labels; empty: random ones.

    Raises:
        MissingModel: There is no model in the folder of ``planned_by``.
        BadModel: It is damaged, or predicts no variance.
        UsageError: The labels are of other grasps, or ``part_filter`` bounds the success of planned ones.
    """
    of_labels = sorted({one.info.planner for one in known.values()})
    if len(of_labels) > 1:
        raise UsageError(
            "--labels: these files hold grasps that were chosen differently; restore each into its own --out"
        )
    if config.planned_by is None:
        found = of_labels[0] if of_labels else ""
    else:
        from mskgrasp.simulation.planned_grasps import PlannedGrasps  # loads torch

        found = PlannedGrasps(config.planned_by).digest
        if of_labels and of_labels != [found]:
            chosen = "another planner chose their grasps" if of_labels[0] else "their grasps are random"
            raise UsageError(f"--labels: {chosen}; leave planned_by out (--planned-by None)")
    if found and config.part_filter.bounds_success:
        raise UsageError(SUCCESS_IS_OF_RANDOM)
    return found


def restorable(
    parts: list[tuple[str, Part]],
    tasks: list[ShardTask],
    known: Mapping[tuple[str, int], ShardLabels],
) -> list[tuple[str, Part]]:
    """The parts all of whose attempts are in the labels: no others can be planned without the model.

    Args:
        parts: By the names given.
        tasks: Their shards.
        known: Labels by part and shard.

    Raises:
        UsageError: There is none.
    """
    hashes = {part.name: part.content_hash for _, part in parts}
    lacking = {
        task.part
        for task in tasks
        if (one := known.get((task.part, task.index))) is None or one.info.part_hash != hashes[task.part]
    }
    complete = [(word, part) for word, part in parts if part.name not in lacking]
    left = len(parts) - len(complete)
    if not complete:
        raise UsageError(
            "--labels: they hold all attempts of none of the parts; use the settings they were made with"
        )
    if left:
        note(
            f"{left} of {len(parts)} parts are left out: labels lack attempts at them, or are of other shapes"
        )
    return complete


def check_labels(info: ShardInfo, config: CollectConfig) -> None:
    """Refuse labels of other settings, or of another simulation.

    Raises:
        UsageError: They are of other settings.
        BadDataset: They are of another version of the simulation.
    """
    name = f"labels of shard {info.index} of part '{info.part}'"
    settings = dict(
        seed=config.seed,
        physics=config.physics.model_dump(),
        noise=config.noise.model_dump(mode="json"),
        intrinsics=config.camera.intrinsics().tolist(),
    )
    changed = [key for key, value in settings.items() if np.asarray(getattr(info, key)).tolist() != value]
    if info.T_base_camera.position[2] != config.camera.height:
        changed.append("camera.height")
    if changed:
        raise UsageError(f"{name} were made with other settings ({', '.join(changed)} differ); use those")
    if info.versions.get("simulation") != str(SIMULATION_VERSION):
        raise BadDataset(
            f"{name} are of simulation version {info.versions.get('simulation')}, not {SIMULATION_VERSION}: "
            "collect them again"
        )
