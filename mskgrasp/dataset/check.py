"""Check of a dataset for missing, damaged and contradictory shards, file by file."""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import BadConfig, BadDataset, BadPart, UsageError
from mskgrasp.dataset.attempts import ShardInfo, problems, shape_problems
from mskgrasp.dataset.ranges import range_problems
from mskgrasp.dataset.shards import read_unchecked, shard_path, success_rate
from mskgrasp.parts import store
from mskgrasp.parts.builtin import is_known

_MOST_MISSING = 100
"""Missing shards of a part that are named one by one."""
SHARED = (
    "seed", "region", "table_z", "intrinsics", "T_base_camera", "physics", "noise", "fidelity", "hand",
    "planner",
)  # fmt: skip
"""Properties that all shards of a dataset share."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Fault that makes a dataset unfit for use.

    Attributes:
        path: The file, in the dataset's folder.
        reason: The fault, without the file's name.
    """

    path: Path
    reason: str


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """Result of a check.

    Attributes:
        n_shards: Files that could be read as shards.
        n_attempts: Attempts in them.
        faults: By file, in the order of their names; a file may have several.
        notes: Remarks that are no faults.
    """

    n_shards: int
    n_attempts: int
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Shard:
    path: Path
    info: ShardInfo
    n: int
    rate: float  # of success
    grasps: str  # digest


def check_dataset(folder: Path, watch: Callable[[Sequence[Path]], Iterable[Path]] = iter) -> CheckResult:
    """Read all of a dataset and report every fault; change nothing.

    Args:
        folder: Folder of the dataset.
        watch: Yields each of the files that will be read; may show a progress bar.

    Raises:
        UsageError: The folder is no dataset: it does not exist or has no folder ``shards``.
    """
    require_dataset(folder)
    faults: list[Fault] = []
    notes: list[str] = []
    paths = []
    for path in sorted((folder / "shards").iterdir()):
        if path.suffix == ".tmp":
            notes.append(f"shards/{path.name} was left by a killed run; the next run clears it away")
        elif path.suffix != ".h5" or not path.is_file():
            faults.append(Fault(path=path, reason="is no shard of this dataset (foreign file); remove it"))
        else:
            paths.append(path)
    shards = []
    for path in watch(paths):
        shard, reasons = _examine(path)
        faults += [Fault(path=path, reason=reason) for reason in reasons]
        shards += [shard] if shard else []
    settings = _settings(folder, faults)
    faults += _name_faults(folder, shards)
    faults += _shared_faults(shards, settings)
    faults += _hash_faults(shards, notes)
    faults += _missing(folder, paths, shards, settings)
    versions = Counter(json.dumps(shard.info.versions, sort_keys=True) for shard in shards)
    if len(versions) > 1:
        notes.append(f"the shards were made with {len(versions)} sets of software versions; see `card`")
    if not shards and not faults:
        faults.append(Fault(path=folder / "shards", reason="holds no shard; collect some"))
    faults.sort(key=lambda fault: fault.path.name)
    n = sum(shard.n for shard in shards)
    return CheckResult(n_shards=len(shards), n_attempts=n, faults=tuple(faults), notes=tuple(notes))


def require_dataset(folder: Path) -> None:
    """Refuse a folder that cannot be a dataset.

    Raises:
        UsageError: It does not exist, is a file, or has no folder ``shards``.
    """
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise UsageError(f"{folder} {what}; give the folder of a dataset, the --out of mskgrasp.collect")
    if not (folder / "shards").is_dir():
        raise UsageError(f"{folder} is no dataset: it has no folder shards; give the --out of a collection")


def _examine(path: Path) -> tuple[_Shard | None, list[str]]:
    try:
        attempts, info = read_unchecked(path)
    except BadDataset as error:
        return None, [str(error).removeprefix(str(path)).lstrip(": ")]
    with np.errstate(all="ignore"):  # a damaged number may be of any size
        reasons = list(problems(attempts)) or list(range_problems(attempts, info))
    if any(shape_problems({"grasp": attempts.grasp, "success": attempts.success})):
        return None, reasons  # its attempts can be neither counted nor compared
    n = len(attempts)
    digest = hashlib.sha256(np.ascontiguousarray(attempts.grasp).tobytes()).hexdigest() if n else ""
    return _Shard(path=path, info=info, n=n, rate=success_rate(attempts.success), grasps=digest), reasons


def _settings(folder: Path, faults: list[Fault]) -> dict[str, Any]:
    """Read the dataset's config.yaml as plain values: its schema belongs to the collector, a higher layer."""
    path = folder / "config.yaml"
    try:
        return read_yaml(path)
    except BadConfig as error:
        faults.append(Fault(path=path, reason=str(error)))
        return {}


def _name_faults(folder: Path, shards: list[_Shard]) -> Iterator[Fault]:
    seen: dict[str, _Shard] = {}
    present = {shard.path.name for shard in shards}
    for shard in shards:
        info = shard.info
        try:
            name = shard_path(folder, info.part, info.index).name
        except BadDataset as error:
            yield Fault(path=shard.path, reason=str(error))
            continue
        if shard.path.name != name:
            what = f"holds shard {info.index} of part '{info.part}'"
            twice = f"which {name} holds, too (duplicate)" if name in present else f"but is not called {name}"
            yield Fault(path=shard.path, reason=f"{what}, {twice}")
        elif shard.grasps and shard.grasps in seen:
            other = seen[shard.grasps].path.name
            yield Fault(path=shard.path, reason=f"holds the same attempts as {other} (duplicate)")
        if shard.grasps and shard.path.name == name:
            seen.setdefault(shard.grasps, shard)


def _shared_faults(shards: list[_Shard], settings: dict[str, Any]) -> Iterator[Fault]:
    for name in SHARED:
        values = [_plain(getattr(shard.info, name)) for shard in shards]
        if not values:
            return
        usual = Counter(values).most_common(1)[0][0]
        if name == "seed" and isinstance(settings.get(name), int):
            usual = _plain(settings[name])
        for shard, value in zip(shards, values, strict=True):
            if value != usual:
                reason = f"{name} {_short(value)} differs from the dataset's {_short(usual)}"
                yield Fault(path=shard.path, reason=reason)
    physics = settings.get("physics")
    if isinstance(physics, dict):
        # Settings that are newer than the dataset are in only one of the two.
        for name, value in shards[0].info.physics.items():
            if name in physics and physics[name] != value:
                reason = f"physics.{name} is {physics[name]!r}, the shards were made with {value!r}"
                yield Fault(path=shards[0].path.parent.parent / "config.yaml", reason=reason)
    families: dict[str, Counter[str]] = defaultdict(Counter)
    for shard in shards:
        families[shard.info.part][shard.info.family] += 1
    right = {}
    for part, found in families.items():
        ready = _in_parts_folder(part, "family")
        right[part] = ready if ready in found else found.most_common(1)[0][0]
    for shard in shards:
        usual = right[shard.info.part]
        if shard.info.family != usual:
            reason = f"family {shard.info.family!r} differs from the part's {usual!r}"
            yield Fault(path=shard.path, reason=reason)


def _plain(value: Any) -> str:
    if hasattr(value, "as_vector"):
        value = value.as_vector()
    return json.dumps(value.tolist() if isinstance(value, np.ndarray) else value, sort_keys=True)


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."


def _hash_faults(shards: list[_Shard], notes: list[str]) -> Iterator[Fault]:
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for shard in shards:
        counts[shard.info.part][shard.info.part_hash] += 1
    right: dict[str, str] = {}
    changed: list[str] = []
    for part, found in sorted(counts.items()):
        ready = _in_parts_folder(part, "content_hash")
        foreign = {h for other, its in counts.items() if other != part for h in its}
        # A hash that another part has, too, is more likely to be wrong.
        right[part] = min(found, key=lambda h: (h != ready, h in foreign, -found[h], h))
        if ready is not None and ready not in found:
            changed.append(part)
    if changed:
        names = ", ".join(changed[:3]) + (", ..." if len(changed) > 3 else "")
        notes.append(
            f"{len(changed)} parts in {store.parts_folder()} are not those that were grasped ({names}); "
            "this dataset cannot be added to"
        )
    for shard in shards:
        part, given = shard.info.part, shard.info.part_hash
        others = [other for other, hash_ in right.items() if hash_ == given and other != part]
        if others:
            yield Fault(path=shard.path, reason=f"part_hash {given[:12]} is that of part '{others[0]}'")
        elif given != right[part]:
            reason = f"part_hash {given[:12]} differs from the part's {right[part][:12]}"
            yield Fault(path=shard.path, reason=reason)


def _in_parts_folder(part: str, key: str) -> str | None:
    """Read a value of the local part of that name; None if there is no such part."""
    if not store.LEGAL_FOLDER.fullmatch(part):
        return None
    try:
        return str(store.read_record(store.parts_folder() / part).get(key))
    except BadPart:
        return None


def _missing(
    folder: Path, paths: list[Path], shards: list[_Shard], settings: dict[str, Any]
) -> Iterator[Fault]:
    """Find missing shards, and those with too few attempts.

    Of a part whose first shard is outside the range of success that the settings keep only that is needed.
    """
    plan = _plan(settings)
    one_is_enough = {one.info.part for one in shards if one.info.index == 0 and not _kept(one.rate, settings)}
    names = {path.name for path in paths}
    highest: dict[str, int] = {}
    for shard in shards:
        highest[shard.info.part] = max(highest.get(shard.info.part, 0), shard.info.index)
        if plan:
            per_part, size = plan
            expected = min(size, per_part - shard.info.index * size)
            made = shard.n + sum(n for n in shard.info.discarded.values() if isinstance(n, int))
            if expected <= 0:
                yield Fault(
                    path=shard.path, reason=f"config.yaml asks for {per_part} attempts, not for these"
                )
            elif made != expected:
                reason = f"holds {shard.n} attempts, {made} with those discarded, must be {expected}"
                yield Fault(path=shard.path, reason=reason)
    words = settings.get("parts")
    asked = {str(word) for word in words} if isinstance(words, (list, tuple)) else set()
    # A part may also be given by its folder, whose own name need not be the part's.
    unknown = sorted(word for word in asked - highest.keys() if not is_known(word))
    missed = len(unknown) - len(highest.keys() - asked)
    if missed > 0:
        reason = f"names {missed} more parts than there are shards of; not found: {', '.join(unknown)}"
        yield Fault(path=folder / "config.yaml", reason=reason)
    asked.difference_update(unknown)
    for part in sorted({*highest, *asked}):
        n = -(-plan[0] // plan[1]) if plan else highest.get(part, 0) + 1
        n = 1 if part in one_is_enough else n
        missing = 0
        for index in range(n):
            try:
                path = shard_path(folder, part, index)
            except BadDataset:
                break  # an illegal name of a part is reported with its shard
            if path.name in names:
                continue
            missing += 1
            if missing > _MOST_MISSING:  # settings may ask for absurdly many
                yield Fault(path=path, reason=f"is missing, of {n} of '{part}'; others are not named")
                break
            yield Fault(path=path, reason="is missing; run the collection again to make it")


def _kept(rate: float, settings: dict[str, Any]) -> bool:
    """Whether a part of this success gets further shards."""
    kept = settings.get("part_filter")
    if not isinstance(kept, dict):
        return True
    low, high = kept.get("min_success"), kept.get("max_success")
    number = (int, float)
    return not (isinstance(low, number) and rate < low) and not (isinstance(high, number) and rate > high)


def _plan(settings: dict[str, Any]) -> tuple[int, int] | None:
    """Get the attempts per part and per shard; None if the settings lack them."""
    per_part, size = settings.get("attempts_per_part"), settings.get("shard_size")
    if isinstance(per_part, int) and isinstance(size, int) and per_part > 0 and size > 0:
        return per_part, size
    return None
