"""Choice of the benchmark's parts, made once: ``python -m tests.benchmark.choose_parts`` rewrites the list.

Only names, sizes and masses decide, no outcome of a grasp:

* The part is built without the extra [cad], was not in the training of the model that ships, its smallest
  edge is at least 4 mm, its middle edge at most 70 mm (the hand opens 80 mm), its mass at most 2 kg.
* Parts are taken in the order of the SHA-256 of their names.
* 20 named standard parts: two to four of each test family that is standardised and, as these are few, five
  fasteners of the split ``new_sizes``: families that a model knows, in sizes that it does not.
* 40 parts of the other test families, one of each in the order of the families' hashes, then a second.
"""

from __future__ import annotations

import csv
import hashlib
import json
from collections import Counter
from collections.abc import Iterable

from mskgrasp.benchmark.part_list import LIST, BenchmarkPart
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import DESCRIPTION
from mskgrasp.parts.catalogue import THIN, Entry, read_index

STANDARD_TEST = {
    "shoulder_screw": 4, "parallel_key": 3, "woodruff_key": 2, "shaft_collar": 2, "rod_end": 2,
    "needle_bearing": 2,
}  # fmt: skip
STANDARD_NEW_SIZES = (
    "hex_bolt", "heavy_flange_bolt", "flange_nut", "cap_nut", "t_nut", "washer", "thick_washer",
    "large_washer", "parallel_pin", "clevis_pin", "button_screw", "thumb_screw",
)  # fmt: skip
N_NEW_SIZES, N_OTHER = 5, 40


def digest(name: str) -> str:
    return hashlib.sha256(f"benchmark {name}".encode()).hexdigest()


def eligible(entry: Entry, training: Iterable[str]) -> bool:
    low, middle, _ = entry.extents
    extra = any(word in entry.source for word in ("bd_warehouse", "build123d", "OpenBuilds"))
    return not extra and entry.name not in training and low >= THIN and middle <= 0.070 and entry.mass <= 2.0


def choose() -> list[BenchmarkPart]:
    training = set(json.loads((PRETRAINED / DESCRIPTION).read_text())["training"]["training_parts"])
    entries = sorted(read_index().parts.values(), key=lambda entry: digest(entry.name))
    entries = [entry for entry in entries if eligible(entry, training)]
    chosen: list[Entry] = []
    for family, n in STANDARD_TEST.items():
        chosen += [one for one in entries if (one.split, one.family) == ("test", family)][:n]
    known = Counter()
    for entry in entries:
        if entry.split == "new_sizes" and entry.family in STANDARD_NEW_SIZES and not known[entry.family]:
            known[entry.family] += 1
            chosen += [entry] if known.total() <= N_NEW_SIZES else []
    standard = {entry.name for entry in chosen}
    others = [one for one in entries if one.split == "test" and one.family not in STANDARD_TEST]
    families = sorted({one.family for one in others}, key=digest)
    ranked = [
        [one for one in others if one.family == family][turn : turn + 1]
        for turn in (0, 1)
        for family in families
    ]
    chosen += [one for few in ranked for one in few][:N_OTHER]
    return [
        BenchmarkPart(
            name=one.name, family=one.family, split=one.split,
            standard=one.source if one.name in standard else "",
        )
        for one in chosen
    ]  # fmt: skip


def main() -> None:
    with open(LIST, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("name", "family", "split", "standard"))
        writer.writerows((one.name, one.family, one.split, one.standard) for one in choose())


if __name__ == "__main__":
    main()
