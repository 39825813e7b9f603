"""The steps of a collection run: choose parts, plan shards, simulate what is missing, summarise."""

from __future__ import annotations

import contextlib
import sys
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from mskgrasp.collect.cluster import (
    check_cluster,
    connected,
    count_cores,
    make_shards_on_cluster,
    wait_until_seen,
)
from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.known_labels import check_labels, chosen_by, restorable
from mskgrasp.collect.workers import make_shards
from mskgrasp.core.config import read_config, write_config
from mskgrasp.core.errors import BadConfig, BadDataset, UsageError
from mskgrasp.core.files import LOCK, exclusive_lock
from mskgrasp.dataset import read_shard, read_success, shard_path
from mskgrasp.dataset.labels import ShardLabels, read_labels
from mskgrasp.dataset.shards import require_own_name, success_rate
from mskgrasp.parts import Part, chosen_names, find_part
from mskgrasp.parts.catalogue import read_index, representative_entries
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred
from mskgrasp.runtime.progress import note, progress
from mskgrasp.runtime.worker_pool import JobDone, JobLost, JobResult, process_count
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import other_versions

MOST_SHARDS = 200_000
"""Files of a dataset."""


def collect(config: CollectConfig) -> None:
    """Make the shards that are missing and sum up the dataset."""
    if config.cluster is not None:
        check_cluster(config.cluster)
    known = read_labels(config.labels)
    planner = chosen_by(config, known)
    for one in known.values():
        check_labels(one.info, config)
    # Sets are stored as names of parts: a catalogue that grows must not change an existing dataset.
    names = chosen_names(config.parts or ("starter",))
    if config.sample:
        names = sampled(names, config.sample)
    config = config.model_copy(update={"parts": tuple(names), "sample": 0})
    check_out(config, parts_chosen=False)  # before parts are built, which takes minutes
    parts = chosen_parts(config)
    if planner and config.planned_by is None:
        parts = restorable(parts, plan_shards(config, [part for _, part in parts]), known)
    hashes = {part.name: part.content_hash for _, part in parts}
    for task in plan_shards(config, [part for _, part in parts]):
        labels = known.get((task.part, task.index))
        if labels is not None and labels.info.part_hash == hashes[task.part]:
            task.check_labels(labels)
    config = config.model_copy(update={"parts": tuple(word for word, _ in parts)})
    check_size(config)
    check_out(config)
    with contextlib.nullcontext() if config.cluster is None else connected(config.cluster):
        make_folder(config.out)
        with exclusive_lock(config.out) as alone:
            if not alone:
                raise UsageError(f"another collection is writing into {config.out}; wait for it, or stop it")
            check_out(config)  # once more: another may have begun and ended since
            _collect(config, [part for _, part in parts], known, planner)


def check_size(config: CollectConfig) -> None:
    """Refuse a dataset of more files than a folder can hold.

    Raises:
        UsageError: It has more than `MOST_SHARDS` shards.
    """
    shards = len(config.parts) * -(-config.attempts_per_part // config.shard_size)
    if shards > MOST_SHARDS:
        raise UsageError(
            f"{len(config.parts)} parts with {config.attempts_per_part} attempts each in files of "
            f"{config.shard_size} are {shards:,} files, at most {MOST_SHARDS:,} are written; raise "
            "shard_size, or lower attempts_per_part"
        )


def sampled(names: list[str], count: int) -> list[str]:
    """Some parts of every family.

    Raises:
        UsageError: A name is not in the catalogue, which knows the families.
    """
    index = read_index()
    unknown = [name for name in names if name not in index.parts]
    if unknown:
        raise UsageError(f"--sample: {unknown[0]!r} is not in the catalogue; sample of its sets or its parts")
    return [entry.name for entry in representative_entries((index.parts[name] for name in names), count)]


def _collect(
    config: CollectConfig, parts: list[Part], known: Mapping[tuple[str, int], ShardLabels], planner: str
) -> None:
    hashes = {part.name: part.content_hash for part in parts}
    # Another processor may round a part's mesh otherwise: its labels belong to that machine.
    other = sorted({name for (name, _), one in known.items() if one.info.part_hash != hashes.get(name)})
    if other := [name for name in other if name in hashes]:
        note(
            f"{len(other)} of {len(parts)} parts are not exactly those of --labels ({', '.join(other[:3])}"
            f"{', ...' if len(other) > 3 else ''}): their grasps are simulated"
        )
    prepare_folder(config)
    tasks = plan_shards(config, parts)
    if config.part_filter.bounds_success:
        _make_missing(config, [task for task in tasks if task.index == 0], parts, known, planner)
        parts = passing_parts(config, parts)
        print(f"{len(parts)} parts pass the part filter by the success of their first shard")
        names = {part.name for part in parts}
        tasks = [task for task in tasks if task.index > 0 and task.part in names]
    _make_missing(config, tasks, parts, known, planner)
    with ctrl_c_deferred():  # takes seconds
        from mskgrasp.collect.report import draw_summary, print_summary, summarise_parts, write_summary

    summaries = summarise_parts(config.out, config.part_filter)
    print_summary(summaries)
    write_summary(summaries, config.out)
    print(f"wrote {config.out / 'summary.json'} and {draw_summary(config.out, config.seed)}")


def passing_parts(config: CollectConfig, parts: list[Part]) -> list[Part]:
    """The parts whose success rate in their first shard the part filter takes."""
    first = {part.name: read_success(shard_path(config.out, part.name, 0))[0] for part in parts}
    return [part for part in parts if config.part_filter.takes_success(success_rate(first[part.name]))]


def _make_missing(
    config: CollectConfig,
    tasks: list[ShardTask],
    parts: list[Part],
    known: Mapping[tuple[str, int], ShardLabels],
    planner: str,
) -> None:
    """Simulate those of the shards that are not on disk."""
    hashes = {part.name: part.content_hash for part in parts}
    checked = progress(tasks, title="check shards", unit="shard")
    missing = [
        task
        for task in checked
        if not is_done(config.out, task, hashes[task.part], known.get((task.part, task.index)), planner)
    ]
    done = sum(task.n for task in tasks) - sum(task.n for task in missing)
    print(
        f"{len(parts)} parts, {sum(task.n for task in tasks)} attempts into {config.out}"
        + (f", {done} of them already there" if done else "")
        + (f"; {_worker_summary(config, missing)}" if missing else "")
    )
    if missing:
        _simulate(config, missing, parts, done)


def _worker_summary(config: CollectConfig, missing: list[ShardTask]) -> str:
    """The workers that will make the missing shards, in words."""
    if config.cluster is not None:
        cores = count_cores()
        waits = "" if cores else " (waiting for nodes to join it)"
        return f"{cores} cores of the cluster at {config.cluster}{waits}"
    return f"{_n_workers(config, missing)} workers"


def _n_workers(config: CollectConfig, missing: list[ShardTask]) -> int:
    return min(process_count(config.workers), len(missing))


def chosen_parts(config: CollectConfig) -> list[tuple[str, Part]]:
    """The requested parts that the filter takes, by the names given; those that are missing are built."""
    parts: list[tuple[str, Part]] = []
    for name in progress(config.parts, title="parts", unit="part"):
        part = find_part(name)
        if not config.part_filter.takes_length(part.longest_axis):
            size = f"longest axis {part.longest_axis * 1e3:.0f} mm"
            print(f"left out {part.name}: {size} is outside the part filter", file=sys.stderr)
        elif part.grade == "coarse" and not config.part_filter.coarse:
            print(
                f"left out {part.name}: coarse, 95 % of its surface is within "
                f"{1e3 * part.hull_error_p95:.2f} mm of its hulls; part_filter.coarse includes it",
                file=sys.stderr,
            )
        else:
            parts.append((name, part))
    names = [part.name for _, part in parts]
    doubles = sorted({name for name in names if names.count(name) > 1})
    if doubles:
        raise UsageError(f"two parts are called '{doubles[0]}'; give each its own name")
    if not parts:
        raise UsageError("no part is left to collect; widen part_filter")
    return parts


def check_out(config: CollectConfig, *, parts_chosen: bool = True) -> None:
    """Refuse an output folder that holds something else; change nothing.

    Args:
        config: Settings.
        parts_chosen: Whether its parts are those that are collected, none of which may be another.

    Raises:
        UsageError: A file is in the way, or the folder has other settings, or is no dataset.
    """
    settings = config.out / "config.yaml"
    if config.out.exists() and not config.out.is_dir():
        raise UsageError(f"--out {config.out} is a file; choose a folder")
    if not settings.exists():
        # A run that is killed before it has settings leaves at most a half-written file of them.
        if config.out.is_dir() and not all(_is_leftover(path) for path in config.out.iterdir()):
            raise UsageError(f"--out {config.out} holds other files; choose a new folder")
        return
    try:
        before = read_config(CollectConfig, settings).identity()
    except BadConfig as error:
        raise UsageError(f"{error}; choose another --out") from error
    now = config.identity()
    changed = [key for key in now if now[key] != before[key] and (parts_chosen or key != "parts")]
    if changed:
        raise UsageError(
            f"{config.out} was made with other settings ({', '.join(changed)} differ); choose another "
            "--out, or the settings in its config.yaml"
        )


def _is_leftover(path: Path) -> bool:
    return path.name == LOCK or (path.name.startswith("config.yaml.") and path.suffix == ".tmp")


def prepare_folder(config: CollectConfig) -> None:
    """Open the dataset's folder, and delete half-written files of a killed run."""
    if not (config.out / "config.yaml").exists():
        write_config(config, config.out / "config.yaml")
    # After the settings: they mark a folder with other files as a dataset.
    make_folder(config.out / "shards")
    for leftover in (*config.out.glob("*.tmp"), *(config.out / "shards").glob("*.tmp")):
        leftover.unlink(missing_ok=True)  # a worker of that run may be about to delete it itself


def plan_shards(config: CollectConfig, parts: list[Part]) -> list[ShardTask]:
    """The shards of a run, in turn over the parts so that an early stop leaves some of each."""
    starts = range(0, config.attempts_per_part, config.shard_size)
    return [
        ShardTask(
            part=part.name,
            folder=str(part.folder),
            index=index,
            first=first,
            n=min(config.shard_size, config.attempts_per_part - first),
            seed=config.seed,
        )
        for index, first in enumerate(starts)
        for part in parts
    ]


def is_done(
    out: Path, task: ShardTask, part_hash: str, labels: ShardLabels | None = None, planner: str = ""
) -> bool:
    """Whether a shard is on disk and whole; a damaged one is reported, and will be made again.

    Args:
        out: The dataset.
        task: The shard.
        part_hash: Content hash of its part.
        labels: Its labels, where they are known: a shard made from them states the software that made them.
        planner: As `chosen_by`.

    Raises:
        BadDataset: The part, the simulation or the planner's model has changed since the shard was made.
        OSError: The system cannot open or read it.
    """
    path = shard_path(out, task.part, task.index)
    if not path.exists():
        return False
    try:
        attempts, info = read_shard(path)
        require_own_name(path, info)
    except BadDataset as error:
        print(f"making again: {error}", file=sys.stderr)
        return False
    made = len(attempts) + sum(info.discarded.values())
    if (info.seed, made) != (task.seed, task.n):
        print(
            f"making again: {path} holds {made} attempts of seed {info.seed}, not {task.n} of {task.seed}",
            file=sys.stderr,
        )
        return False
    if info.part_hash != part_hash:
        raise BadDataset(
            f"{path}: part '{task.part}' has changed since; delete its shards or choose another --out"
        )
    if info.fidelity != "cpu":
        raise BadDataset(
            f"{path} holds labels of fidelity '{info.fidelity}', the collector makes those of 'cpu'; choose "
            "another --out"
        )
    if info.planner != planner:
        one, other = (
            f"planner {digest[:8]}" if digest else "random grasps" for digest in (info.planner, planner)
        )
        raise BadDataset(
            f"{path} was made with {one}, this run with {other}; choose another --out, or name the same "
            "--planned-by or --labels"
        )
    other = other_versions(info.versions)
    if other and (labels is None or labels.info.versions != info.versions):
        raise BadDataset(f"{path} was made by other software: {other}; choose another --out")
    return True


def _simulate(config: CollectConfig, tasks: list[ShardTask], parts: list[Part], done: int) -> None:
    started = time.monotonic()
    total: Counter[int] = Counter()
    by_shard: dict[ShardTask, Counter[int]] = {}
    workers: set[str] = set()
    bar = progress(total=done + sum(task.n for task in tasks), done=done, unit="grasp", keep=True)
    if config.cluster is None:
        events = make_shards(config, tasks, _n_workers(config, tasks))
    else:
        events = make_shards_on_cluster(config, tasks, {part.name: part for part in parts})
    try:
        for event in events:
            match event:
                case JobResult(job=task, result=outcome):
                    total[outcome] += 1
                    by_shard.setdefault(task, Counter())[outcome] += 1
                    rate = total[1] / max(total[0] + total[1], 1)
                    of = " of this run" if done else ""
                    bar.set_postfix_str(f"success{of} {rate:.1%}", refresh=False)
                    bar.update(1)
                case JobLost(job=task, reason=reason, n_results=undone):
                    total.subtract(by_shard.pop(task, Counter()))
                    bar.update(-undone)
                    note(f"a worker died ({reason}); its shard is made again")
                case JobDone(worker=worker):
                    workers.add(worker)
    finally:
        events.close()
        bar.close()
    seconds = time.monotonic() - started
    if config.cluster is not None:
        wait_until_seen(config.out, tasks)
    attempts = total[0] + total[1]
    print(
        f"{attempts} grasps in {seconds:.0f} s: {attempts / seconds:.1f} grasps/s with {len(workers)} workers"
    )
