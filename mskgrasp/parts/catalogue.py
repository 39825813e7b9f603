"""Index of the catalogue: data, split and rating of every part.

``catalogue.json`` in the parts folder is generated from the part folders and may be deleted at any time; only
the ratings, which the command ``rate`` computes from a dataset, are lost with it.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.core.files import write_whole
from mskgrasp.parts import store
from mskgrasp.parts.builtin import builtin_names, recipe_hash, starter_names, unknown_part
from mskgrasp.parts.names import SPLITS, Split
from mskgrasp.parts.recipes import cad, families
from mskgrasp.parts.recipes.families import VARIANT_OF

INDEX_VERSION = 2
INDEX_NAME = "catalogue.json"
USABLE_LENGTH = (0.020, 0.150)
"""Longest axis of the catalogue's parts, metres: the paper's range."""
THIN = 0.004
"""Parts flatter than this count as thin, metres: most of their grasps would touch the table."""
NEIGHBOUR = 1.10
"""Parts of a family whose sorted edges all differ by less than this factor are near-duplicates."""

_FAMILY_SHARES: dict[Split, float] = {"test": 0.15, "validation": 0.08}
_KNOWN_SHARE = 0.08


@dataclass(frozen=True, kw_only=True)
class Rating:
    """Success rate of a part in random grasps.

    Attributes:
        attempts: Number of grasps.
        successes: Number of grasps that lifted the part.
        interval: 95 % Wilson interval of the success rate.
        part_hash: Content hash of the part that was grasped; a rating of another shape is dropped.
        dataset: Folder of the dataset.
    """

    attempts: int
    successes: int
    interval: tuple[float, float]
    part_hash: str
    dataset: str

    @property
    def rate(self) -> float:
        """Share of the grasps that lifted the part."""
        return self.successes / max(self.attempts, 1)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One part of the catalogue; lengths in metres.

    Attributes:
        name: Name of the part.
        family: Kind of part.
        source: Standard, or another origin of the dimensions.
        licence: SPDX identifier.
        longest_axis: Longest edge of the oriented minimal box.
        extents: Edges of the bounding box, sorted, the longest last.
        volume: Cubic metres.
        mass: kg.
        n_hulls: Number of convex hulls.
        hull_error: Largest distance between hulls and mesh.
        hull_error_p95: 95th percentile of it.
        hull_volume_ratio: Volume of the hulls' union divided by that of the mesh.
        content_hash: Content hash of the part.
        recipe_hash: Hash of its recipe.
        group: Shared by near-duplicates: the name of the first of them.
        split: Side of the split (`split_of`), the same for all of a group.
        rating: From a collected dataset; None before the command ``rate``.
    """

    name: str
    family: str
    source: str
    licence: str
    longest_axis: float
    extents: tuple[float, float, float]
    volume: float
    mass: float
    n_hulls: int
    hull_error: float
    hull_error_p95: float
    hull_volume_ratio: float
    content_hash: str
    recipe_hash: str
    group: str = ""
    split: Split = "train"
    rating: Rating | None = None


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """Reason why a recipe is left out of the catalogue, and that recipe's hash."""

    reason: str
    recipe_hash: str


@dataclass(frozen=True, kw_only=True)
class Index:
    """The catalogue: its parts by name, and what was left out."""

    parts: Mapping[str, Entry]
    left_out: Mapping[str, LeftOut]

    def families(self) -> Counter[str]:
        """Number of parts by family."""
        return Counter(entry.family for entry in self.parts.values())


def index_path() -> Path:
    """Path of the index."""
    return store.parts_folder() / INDEX_NAME


def read_index() -> Index:
    """The index as last written; empty where there is none.

    Raises:
        BadPart: The file is damaged.
    """
    path = index_path()
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        return Index(parts={}, left_out={})
    try:
        record = json.loads(text)
        if record["index_version"] != INDEX_VERSION:
            return Index(parts={}, left_out={})
        parts = {name: _entry(name, values) for name, values in record["parts"].items()}
        left_out = {name: LeftOut(**values) for name, values in record["left_out"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadPart(
            f"{path} is damaged: delete it, then run: python -m mskgrasp.parts build --catalogue"
        ) from error
    return Index(parts=parts, left_out=left_out)


def write_index(index: Index) -> None:
    """Write the index atomically."""
    record = {
        "index_version": INDEX_VERSION,
        "parts": {name: asdict(entry) for name, entry in sorted(index.parts.items())},
        "left_out": {name: asdict(entry) for name, entry in sorted(index.left_out.items())},
    }
    path = index_path()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(record, indent=1, sort_keys=True).encode())


def entry_of(name: str) -> Entry:
    """The index entry of a built part, from its ``part.json`` alone.

    Raises:
        BadPart: There is no such part folder, or its record is damaged.
    """
    folder = store.parts_folder() / name
    record = store.read_record(folder)
    try:
        low, middle, high = sorted(float(edge) for edge in record["extents"])
        return Entry(
            name=name,
            family=record["family"],
            source=record["source"],
            licence=record["licence"],
            longest_axis=record["longest_axis"],
            extents=(low, middle, high),
            volume=record["volume"],
            mass=record["mass"],
            n_hulls=record["n_hulls"],
            hull_error=record["hull_error"],
            hull_error_p95=record["hull_error_p95"],
            hull_volume_ratio=record["hull_volume_ratio"],
            content_hash=record["content_hash"],
            recipe_hash=record["recipe_hash"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise BadPart(
            f"{folder / 'part.json'} is damaged ({error}): delete the folder and build again"
        ) from error


def make_index(entries: Iterable[Entry], failures: Mapping[str, str], before: Index) -> Index:
    """Make the index of the usable, distinct parts, with groups, split and ratings.

    Args:
        entries: Entries of all built parts.
        failures: Reason of each part that could not be built.
        before: The previous index; ratings of parts that have not changed are kept.
    """
    left_out = {name: LeftOut(reason=why, recipe_hash=recipe_hash(name)) for name, why in failures.items()}
    kept: dict[str, Entry] = {}
    seen: dict[tuple[float, ...], str] = {}
    for entry in sorted(entries, key=lambda entry: entry.name):
        low, high = USABLE_LENGTH
        key = (*(round(edge, 4) for edge in entry.extents), round(entry.volume, 8))
        reason = ""
        if not low <= entry.longest_axis <= high:
            reason = (
                f"longest axis {1e3 * entry.longest_axis:.1f} mm, legal {1e3 * low:.0f} to {1e3 * high:.0f}"
            )
        elif key in seen:
            reason = f"duplicate of {seen[key]} by its edges and volume"
        if reason:
            left_out[entry.name] = LeftOut(reason=reason, recipe_hash=entry.recipe_hash)
            continue
        seen[key] = entry.name
        old = before.parts.get(entry.name)
        same = old is not None and old.rating is not None and old.rating.part_hash == entry.content_hash
        kept[entry.name] = replace(entry, rating=old.rating if old and same else None)
    groups = near_duplicates(kept.values())
    parts = {
        name: replace(entry, group=groups[name], split=split_of(entry.family, groups[name]))
        for name, entry in kept.items()
    }
    return Index(parts=parts, left_out=left_out)


def near_duplicates(entries: Iterable[Entry]) -> dict[str, str]:
    """Groups of near-duplicates by part: the transitive closure of neighbouring sizes within a family."""
    by_family: dict[str, list[Entry]] = defaultdict(list)
    for entry in entries:
        by_family[entry.family].append(entry)
    group: dict[str, str] = {}
    for members in by_family.values():
        members.sort(key=lambda entry: entry.name)
        edges = np.log(np.array([entry.extents for entry in members]))
        close = np.abs(edges[:, None] - edges[None]).max(axis=-1) < np.log(NEIGHBOUR)
        for number, entry in enumerate(members):
            if entry.name in group:
                continue
            pending = [number]
            while pending:
                current = pending.pop()
                if members[current].name not in group:
                    group[members[current].name] = entry.name
                    pending += np.flatnonzero(close[current]).tolist()
    return group


def split_of(family: str, group: str) -> Split:
    """The split of a part, by hashes of names, so that it never changes.

    ``test`` and ``validation`` are whole families, with their variants: nothing like them is trained on.
    ``new_sizes`` are groups of near-duplicates within the other families.
    """
    number = _hash(f"family {VARIANT_OF.get(family, family)}")
    for side, share in _FAMILY_SHARES.items():
        number -= share
        if number < 0:
            return side
    return "new_sizes" if _hash(group) < _KNOWN_SHARE else "train"


def splits_of(names: Iterable[str], index: Index) -> dict[str, Split]:
    """The split of those parts that have a recipe, of parts that the index lacks, too.

    An index lacks what could not be built on this machine, such as all CAD parts without the extra ``[cad]``.
    Their families are known from the recipes; the groups of such parts are not, and each counts as its own.
    """
    family_of = {one.name: one.family for one in (*families.recipes().values(), *cad.recipes())}
    found: dict[str, Split] = {}
    for name in names:
        if name in index.parts:
            found[name] = index.parts[name].split
        elif name in family_of:
            found[name] = split_of(family_of[name], name)
    return found


def _hash(name: str) -> float:
    return int.from_bytes(hashlib.sha256(f"split {name}".encode()).digest()[:8], "big") / 2**64


def require_name(word: str) -> None:
    """Refuse an empty word, which as a path would be the current folder.

    Raises:
        UnknownPart: It is empty.
    """
    if not word.strip():
        raise UnknownPart("the name of a part is empty: `python -m mskgrasp.parts list` shows the names")


def chosen_names(words: Iterable[str]) -> list[str]:
    """Names of parts by names, folders, or the sets below.

    ``starter``: 25 parts, built in a few seconds. ``catalogue``: all parts of the catalogue.
    ``train``, ``validation``, ``test``, ``new_sizes``: the parts of the catalogue in that split.

    Raises:
        BadPart: A set of the catalogue is named before the catalogue is built.
        UnknownPart: A word is empty.
    """
    names: list[str] = []
    for word in words:
        require_name(word)
        if word == "starter":
            names += starter_names()
        elif word == "catalogue" or word in SPLITS:
            index = read_index()
            if not index.parts:
                raise BadPart(
                    f"the set {word!r} needs the catalogue: python -m mskgrasp.parts build --catalogue"
                )
            names += [n for n, entry in index.parts.items() if word in ("catalogue", entry.split)]
        else:
            names.append(word)
    return list(dict.fromkeys(names))


def representative_entries(entries: Iterable[Entry], count: int) -> list[Entry]:
    """About ``count`` parts: of each family in proportion to the root of its size, evenly by volume."""
    families: dict[str, list[Entry]] = defaultdict(list)
    for entry in entries:
        families[entry.family].append(entry)
    scale = count / max(sum(np.sqrt(len(members)) for members in families.values()), 1.0)
    chosen = []
    for _, members in sorted(families.items()):
        n = min(len(members), max(1, round(scale * np.sqrt(len(members)))))
        members.sort(key=lambda entry: (entry.volume, entry.name))
        chosen += [members[int((i + 0.5) * len(members) / n)] for i in range(n)]
    return chosen


def with_ratings(index: Index, found: Mapping[str, Rating]) -> Index:
    """The index with new ratings, by name.

    Raises:
        BadPart: A part is not in the catalogue, or has changed since it was grasped.
    """
    parts = dict(index.parts)
    for name, rating in found.items():
        entry = parts.get(name)
        if entry is None:
            known = name in builtin_names()
            raise (
                BadPart(f"part {name!r} is not in the catalogue: build it first")
                if known
                else (unknown_part(name, builtin_only=True))
            )
        if entry.content_hash != rating.part_hash:
            raise BadPart(f"part {name!r} has changed since the dataset was collected: collect it again")
        parts[name] = replace(entry, rating=rating)
    return Index(parts=parts, left_out=index.left_out)


def _entry(name: str, values: dict[str, Any]) -> Entry:
    low, middle, high = (float(edge) for edge in values["extents"])
    rating = values["rating"]
    if rating is not None:
        below, above = rating["interval"]
        rating = Rating(**(rating | {"interval": (float(below), float(above))}))
    if values["name"] != name or values["split"] not in SPLITS:
        raise ValueError(name)
    return Entry(**(values | {"extents": (low, middle, high), "rating": rating}))
