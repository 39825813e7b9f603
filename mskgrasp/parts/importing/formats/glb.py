"""GLB, the binary form of glTF 2.0."""

from __future__ import annotations

import io
import json
import struct
import warnings
from typing import Any

import numpy as np
import trimesh

from mskgrasp.parts.importing.formats import MOST_TRIANGLES, Loaded, Unreadable
from mskgrasp.parts.importing.formats.float32 import COARSEST, check_resolution
from mskgrasp.parts.solids.surface import Surface

_PACKED = ("draco", "meshopt", "quantization")
_MOST_INSTANCES = 10_000


def load_glb(content: bytes, *, coarsest: float = COARSEST) -> Loaded:
    """Read all meshes of a GLB, each instance placed by its nodes; metres by the standard.

    Args:
        content: The file's bytes.
        coarsest: Largest step between neighbouring coordinates, by the length of all meshes.

    Raises:
        Unreadable: It is damaged, compressed, keeps its geometry in other files, or is too far from its
            origin.
    """
    _check_header(_header(content))
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(
                io.BytesIO(content),
                file_type="glb",
                process=False,
                skip_materials=True,
                merge_primitives=True,
            )
            objects, farthest = _objects(scene)
            check_resolution(objects, farthest, coarsest=coarsest)
    except Unreadable:
        raise
    except Exception as error:  # the reader raises exceptions of many types
        reason = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise Unreadable(f"is not a readable GLB ({reason[:80]}): export it again") from error
    return Loaded(objects=objects, unit="m", unit_mm=1000.0, unit_by_convention=True)


def _objects(scene: trimesh.Scene) -> tuple[tuple[Surface, ...], float]:
    """The meshes as they are placed, and the largest coordinate as it is stored, in the scene's unit."""
    placed = scene.graph.nodes_geometry
    total, farthest = 0, 0.0
    result = []
    for number, node in enumerate(placed):
        matrix, name = scene.graph.get(node)
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        total += len(mesh.faces)
        if total > MOST_TRIANGLES or number >= _MOST_INSTANCES:
            raise Unreadable(
                f"places over {MOST_TRIANGLES:,} triangles or {_MOST_INSTANCES:,} instances: export one part"
            )
        vertices = np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        faces = np.asarray(mesh.faces, dtype=np.int64)
        # Matrices of nodes are text, with all digits: what is placed far away by one is as fine as before.
        scale = np.linalg.norm(matrix[:3, :3], axis=0).max()
        farthest = max(farthest, float(scale * np.abs(mesh.vertices).max(initial=0.0)))
        # A mirrored instance is wound the other way round.
        result.append(
            Surface(vertices=vertices, faces=faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces)
        )
    return tuple(result), farthest


def _header(content: bytes) -> dict[str, Any]:
    if len(content) < 20 or content[:4] != b"glTF":
        raise Unreadable("is not a GLB (its first four bytes are not glTF): export it again as GLB")
    version, length = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise Unreadable(f"is GLB of version {version}, only 2 is read: export it again as glTF 2.0 binary")
    if length > len(content):
        raise Unreadable(
            f"is cut off: its header states {length:,} bytes, the file has {len(content):,}; copy it again"
        )
    size, kind = struct.unpack_from("<I4s", content, 12)
    try:
        tree = json.loads(content[20 : 20 + size].decode()) if kind == b"JSON" else None
    except (ValueError, RecursionError) as error:
        raise Unreadable("is not a readable GLB (its JSON is damaged): export it again") from error
    if not isinstance(tree, dict):
        raise Unreadable("is not a readable GLB (it has no JSON): export it again")
    return tree


def _check_header(tree: dict[str, Any]) -> None:
    for buffer in _entries(tree, "buffers"):
        uri = str(buffer.get("uri", "data:"))
        if not uri.startswith("data:"):
            raise Unreadable(f"keeps its geometry in another file, {uri[:60]!r}: export it as one GLB")
    for name in tree.get("extensionsRequired", ()):
        if any(word in str(name).lower() for word in _PACKED):
            raise Unreadable(f"is compressed ({name}): export it without compression")
    for accessor in _entries(tree, "accessors"):
        # Without a buffer it is all zeros, in any number that the file claims.
        if "bufferView" not in accessor:
            raise Unreadable(
                "has an array without data (sparse or compressed): export it without compression"
            )
    # Section 3.5.2 of the glTF specification: nodes form trees.
    children = [str(child) for node in _entries(tree, "nodes") for child in node.get("children", ())]
    roots = {str(root) for scene in _entries(tree, "scenes") for root in scene.get("nodes", ())}
    if len(set(children)) < len(children) or roots & set(children):
        raise Unreadable("is not a readable GLB (a node has two parents or is its own): export it again")


def _entries(tree: dict[str, Any], key: str) -> list[dict[str, Any]]:
    entries = tree.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise Unreadable(f"is not a readable GLB ({key} is not a list of objects): export it again")
    return entries
