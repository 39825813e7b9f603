"""Repairs of closed surfaces that keep their shape.

Equal vertices are merged, faces without area are dropped, and faces are wound outwards. No hole is closed or
filled, and nothing is guessed: other defects are refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.winding import winding_number
from mskgrasp.parts.solids.surface import Surface

_LOOKS = 16
"""Faces of a body at which it is looked whether another encloses it."""

WELD_MM = 1e-3
"""Vertices closer than this are merged where the surface is open otherwise (as between faces of STEP)."""


@dataclass(frozen=True, kw_only=True)
class Repairs:
    """Number of repairs by kind."""

    merged: int = 0
    welded: int = 0
    degenerate: int = 0
    doubled: int = 0
    turned: int = 0

    def __add__(self, other: Repairs) -> Repairs:
        return Repairs(**{name: value + getattr(other, name) for name, value in vars(self).items()})

    def sentences(self) -> tuple[str, ...]:
        """Report for the user; merging is not reported, since STL repeats every vertex."""
        return tuple(
            sentence
            for count, sentence in (
                (self.welded, f"welded {count_of(self.welded, 'vertex')} closer than {WELD_MM} mm"),
                (self.degenerate, f"dropped {count_of(self.degenerate, 'degenerate face')}"),
                (self.doubled, f"dropped {count_of(self.doubled, 'face')} lying on another"),
                (self.turned, f"turned {count_of(self.turned, 'face')} outward"),
            )
            if count
        )


def count_of(number: int, thing: str) -> str:
    """``2,000 faces``, ``1 vertex``."""
    plural = {"vertex": "vertices", "body": "bodies"}.get(thing, thing + "s")
    return f"{number:,} {thing if number == 1 else plural}"


def close_surface(surface: Surface) -> tuple[Surface, Repairs]:
    """Make a surface whose faces join edge to edge from one that may repeat vertices and faces.

    Raises:
        BadPart: It is flat or open; the message starts with "is" and names no file.
    """
    merged, count = _merge_equal(surface)
    _check_not_flat(merged)
    # In the order of increasing change; the first that closes the surface is taken.
    for weld in (False, True):
        candidate, joined = _weld(merged) if weld else (merged, 0)
        for keep_one in (False, True):
            known = Repairs(merged=count, welded=joined)
            repaired, repairs = _drop_faces(candidate, known, keep_one=keep_one)
            if len(repaired.faces) and _open_edges(repaired) == (0, 0):
                return repaired, repairs
            if not repairs.doubled:
                break
    surface, _ = _drop_faces(merged, Repairs(), keep_one=False)
    if len(surface.faces) == 0:
        raise BadPart(f"is {_SHEET}")
    border, crowded = _open_edges(surface)
    if border:
        raise BadPart(
            f"is open: {count_of(border, 'edge')} of its surface bound one face only; close the holes, for "
            "example with MeshLab's 'Close Holes' or Blender's 3D-Print Toolbox, or export a solid"
        )
    raise BadPart(
        f"is not a proper solid: at {count_of(crowded, 'edge')} an odd number of faces meet; remove inner "
        "walls and export it again"
    )


def wind_consistently(surface: Surface) -> tuple[Surface, np.ndarray, np.ndarray]:
    """Wind neighbouring faces of a closed surface the same way.

    Returns:
        The surface; (m,) the piece of each face (pieces share no edge); (m,) whether it was turned.

    Raises:
        BadPart: No winding is consistent (as on a Klein bottle).
    """
    faces = surface.faces
    count = len(faces)
    first, second, same_way, crowded = _neighbours(surface)
    turned = np.zeros(count, dtype=bool)
    if same_way.any():
        # Every face has two nodes in this graph, as it is and turned; edges join the nodes that agree.
        flip = np.where(same_way, count, 0)
        rows = np.concatenate([first, first + count])
        columns = np.concatenate([second + flip, second + count - flip])
        group = _components(rows, columns, 2 * count)
        if (group[:count] == group[count:]).any():
            raise BadPart(
                "is not a proper solid: its faces cannot all be wound outward (a one-sided surface); "
                "repair it"
            )
        # Of the two consistent windings, the one that turns fewer faces.
        kept = np.bincount(group[:count], minlength=group.max() + 1)
        turned = kept[group[:count]] < kept[group[count:]]
        tied = kept[group[:count]] == kept[group[count:]]
        turned |= tied & (group[:count] > group[count:])
        faces = np.where(turned[:, None], faces[:, ::-1], faces)
    if crowded.size:
        first = np.concatenate([first, crowded[:, 0]])
        second = np.concatenate([second, crowded[:, 1]])
    piece = _components(first, second, count)
    surface = Surface(vertices=surface.vertices, faces=faces)
    key, up = _edges(surface)
    if not np.array_equal(np.sort(key[up]), np.sort(key[~up])):
        raise BadPart(
            "is not a proper solid: its faces cannot all be wound outward where several meet at an edge; "
            "remove inner walls and export it again"
        )
    return surface, piece, turned


_SHEET = "a flat sheet, its volume is zero: give it a thickness in the CAD program"


def _merge_equal(surface: Surface) -> tuple[Surface, int]:
    used = surface.vertices + 0.0  # makes -0.0 and 0.0 one
    index, inverse = _unique_rows(used)
    return (
        Surface(vertices=used[index], faces=inverse[surface.faces]),
        len(used) - len(index),
    )


def _unique_rows(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of each distinct row's first appearance, in order of appearance; each row's distinct one."""
    bits = np.ascontiguousarray(points, dtype=np.float64).view(np.uint64)
    key = np.zeros(len(points), dtype=np.uint64)
    for column in bits.T:  # sorting one number for each row is many times faster than sorting rows
        key = (key ^ column) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    _, index, inverse = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(
        points[index][inverse], points
    ):  # two rows with one key: about once in 10^6 huge meshes
        _, index, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(index)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return index[order], rank[np.reshape(inverse, -1)]


def _weld(surface: Surface) -> tuple[Surface, int]:
    pairs = KDTree(surface.vertices).query_pairs(WELD_MM, output_type="ndarray")
    count = len(surface.vertices)
    group = _components(pairs[:, 0], pairs[:, 1], count)
    _, index = np.unique(group, return_index=True)
    return Surface(vertices=surface.vertices[index], faces=group[surface.faces]), count - len(index)


def _drop_faces(surface: Surface, repairs: Repairs, *, keep_one: bool) -> tuple[Surface, Repairs]:
    """Without faces that name a vertex twice or repeat another face.

    Two faces back to back enclose nothing and both go, unless ``keep_one``: some exporters write every face
    from both sides. Where they do so with some bodies of a file only, one side of these stays in any case.
    """
    faces = surface.faces
    a, b, c = faces.T
    sound = (a != b) & (b != c) & (c != a)
    faces = faces[sound]
    degenerate = len(sound) - len(faces)
    keep, gone = _without_doubles(faces, keep_one=keep_one)
    if len(gone):
        bodies = _bodies_beside(Surface(vertices=surface.vertices, faces=faces), keep, gone)
        keep = np.sort(np.concatenate([keep, bodies]))
    repairs = replace(repairs, degenerate=degenerate, doubled=len(faces) - len(keep))
    faces = faces[keep]
    used = np.zeros(len(surface.vertices), dtype=bool)
    used[faces] = True
    compact = np.cumsum(used) - 1
    return Surface(vertices=surface.vertices[used], faces=compact[faces]), repairs


def _bodies_beside(surface: Surface, keep: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Index of those of the faces ``gone`` that bound bodies beside what the faces ``keep`` bound.

    A closed surface within that is no body: there it is the cavity that another body fills.
    """
    rest = Surface(vertices=surface.vertices, faces=surface.faces[keep])
    if _open_edges(rest) != (0, 0):
        return gone[:0]
    lost = Surface(vertices=surface.vertices, faces=surface.faces[gone])
    key = _edges(lost)[0]
    order = np.argsort(key, kind="stable")
    face, same = order // 3, key[order][1:] == key[order][:-1]
    piece = _components(face[:-1][same], face[1:][same], len(gone))
    _, edge, count = np.unique(key, return_inverse=True, return_counts=True)
    is_open = np.zeros(piece.max() + 1, dtype=bool)
    is_open[np.repeat(piece, 3)[count[np.reshape(edge, -1)] % 2 == 1]] = True
    if len(keep):
        rest = wind_consistently(rest)[0]
    chosen = [gone[:0]]
    for number in np.flatnonzero(~is_open):
        members = np.flatnonzero(piece == number)
        looked = lost.triangles[members[:: -(-len(members) // _LOOKS)]].mean(axis=1)
        if not all(abs(winding_number(rest.triangles, point)) > 0.5 for point in looked):
            chosen.append(gone[members])
    return np.concatenate(chosen)


def _without_doubles(faces: np.ndarray, *, keep_one: bool) -> tuple[np.ndarray, np.ndarray]:
    """Index of the faces to keep, of several alike the first; the first of those that go altogether."""
    everything = np.arange(len(faces))
    low, middle, top = np.sort(faces, axis=1).T
    order = np.lexsort((top, middle, low))
    key = np.stack([low, middle, top], axis=1)[order]
    fresh = np.r_[True, (key[1:] != key[:-1]).any(axis=1)] if len(key) else np.zeros(0, dtype=bool)
    if fresh.all():
        return everything, everything[:0]
    group = np.empty(len(faces), dtype=np.int64)
    group[order] = np.cumsum(fresh) - 1
    # Even permutations of the sorted triple run one way round, odd ones the other.
    a, b, c = faces.T
    way = np.where((a < b).astype(int) + (b < c) + (c < a) == 2, 1, -1)
    wanted = (np.sign(np.bincount(group, weights=way))[group] == way) | keep_one
    candidates = everything[wanted]
    _, leading = np.unique(group[candidates], return_index=True)
    keep = candidates[leading]
    _, first = np.unique(group, return_index=True)
    return np.sort(keep), np.sort(first[~np.isin(np.arange(len(first)), group[keep])])


def _check_not_flat(surface: Surface) -> None:
    size = np.ptp(surface.vertices, axis=0) if len(surface.vertices) else np.zeros(3)
    if len(surface.faces) == 0 or size.min() <= 1e-9 * size.max():
        raise BadPart(f"is {_SHEET}")


def _edges(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Keys of the edges of all faces (lower vertex, higher vertex); whether each runs up."""
    start, end = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    return np.minimum(start, end) * len(surface.vertices) + np.maximum(start, end), start < end


def _open_edges(surface: Surface) -> tuple[int, int]:
    """Number of edges that bound a single face, and of edges that join three, five, ... faces."""
    key = np.sort(_edges(surface)[0])
    if len(key) % 2 == 0 and (key[::2] == key[1::2]).all():  # all in pairs: the usual case
        return 0, 0
    count = np.diff(np.flatnonzero(np.r_[True, key[1:] != key[:-1], True]))
    return int((count == 1).sum()), int(((count % 2 == 1) & (count > 1)).sum())


def _neighbours(surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Faces (e,), (e,) at an edge of two; whether they run it the same way; pairs (f, 2) at other edges."""
    key, up = _edges(surface)
    order = np.argsort(key, kind="stable")
    key, face, up = key[order], order // 3, up[order]
    same = key[1:] == key[:-1]
    alone = np.r_[True, ~same][:-1] & same & np.r_[~same[1:], True]
    pair = np.flatnonzero(alone)
    other = np.flatnonzero(same & ~alone)
    return (
        face[pair],
        face[pair + 1],
        up[pair] == up[pair + 1],
        np.stack([face[other], face[other + 1]], axis=1),
    )


def _components(rows: np.ndarray, columns: np.ndarray, count: int) -> np.ndarray:
    graph = coo_matrix((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(count, count))
    return connected_components(graph, directed=False)[1]
