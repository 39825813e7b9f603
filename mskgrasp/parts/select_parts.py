"""Selection of parts by names, folders and sets."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import read_bounded
from mskgrasp.parts.builtin import find_part, starter_names
from mskgrasp.parts.catalogue import chosen_names
from mskgrasp.parts.names import SETS, SPLITS

_MOST_BYTES = 2**20
"""Largest file of names."""
_SO_MANY = re.compile(r"(.+):(\d+)")


def part_names(words: Iterable[str], training: Mapping[str, Any], n_parts: int = 0) -> list[str]:
    """Names or folders of parts by names, folders and sets.

    ``train``, ``validation``, ``test`` and ``new_sizes``: the sets of the model, where its training names
    them; otherwise those of the catalogue, all but the first without parts that the model was trained on,
    and ``test`` and ``new_sizes`` without those that stopped its training and calibrated it.
    ``all``: every part of the starter set. Other words as in `mskgrasp.parts.chosen_names`. A set with a
    number, as in ``train:50``, is so many of its parts, chosen as by ``n_parts``. A file ``.txt`` is the
    names in it, one a line.

    Args:
        words: Names, folders and sets.
        training: Training record of a model.
        n_parts: Where positive, the greatest number of parts, in equal shares of the words, evenly spaced in
            the order of names; a larger number includes the parts of a smaller one.

    Raises:
        BadPart: A part is unknown.
        UsageError: Two parts have the same name.
    """
    sets = []
    for text in words:
        known = training.get("training_parts") or ()
        limited = _SO_MANY.fullmatch(text)
        word = limited[1] if limited else text
        if word == "train" and known:
            sets.append(list(known))
        elif word in SPLITS and word != "train":
            unseen = training.get(f"{word}_parts")
            seen = {*known, *(training.get("validation_parts") or () if word != "validation" else ())}
            sets.append(unseen or [name for name in chosen_names((word,)) if name not in seen])
        elif word.endswith(".txt"):
            sets.append(chosen_names(_listed(Path(word))))
        elif not limited and ":" in text and text.partition(":")[0] in SETS:
            raise UsageError(f"--parts {text}: after the colon comes a number, as in train:50")
        else:
            sets.append(starter_names() if word == "all" else chosen_names((word,)))
        if limited:
            if not 1 <= int(limited[2]) <= len(sets[-1]):
                raise UsageError(f"--parts {text}: {word} has {len(sets[-1])} parts; legal: 1 to that number")
            sets[-1] = evenly(list(sets[-1]), int(limited[2]))
    if n_parts:
        sets = [evenly(list(one), share) for one, share in zip(sets, _shares(sets, n_parts), strict=True)]
    names = list(dict.fromkeys(name for one in sets for name in one))
    sources: dict[str, str] = {}
    for source in names:
        name = find_part(source).name
        if name in sources:
            raise UsageError(f"--parts: {sources[name]} and {source} are both called {name!r}; leave one out")
        sources[name] = source
    return names


def _listed(path: Path) -> list[str]:
    try:
        lines = read_bounded(path, _MOST_BYTES).decode().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--parts: cannot read the names in {path} ({error}); name a text file") from error
    names = [name for line in lines if (name := line.strip())]
    if not names:
        raise UsageError(f"--parts: {path} holds no name; write one a line")
    return names


def evenly(names: Sequence[str], n: int) -> list[str]:
    """At most n names, evenly spaced in sorted order; a larger n includes the names of a smaller one."""
    in_order = sorted(names)
    # Multiples of the golden ratio modulo 1 fill the interval evenly for any n.
    places = (k * 0.6180339887498949 % 1.0 for k in itertools.count())
    chosen: dict[int, None] = {}
    while len(chosen) < min(n, len(in_order)):
        chosen[int(next(places) * len(in_order))] = None
    return [in_order[i] for i in sorted(chosen)]


def _shares(sets: Sequence[Sequence[str]], n: int) -> list[int]:
    """Number of parts of each set, n in total where there are enough; large sets fill up for small ones."""
    shares = [0] * len(sets)
    while sum(shares) < min(n, sum(map(len, sets))):
        open_ = [i for i, one in enumerate(sets) if shares[i] < len(one)]
        shares[min(open_, key=lambda i: shares[i])] += 1
    return shares
