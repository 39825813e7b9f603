"""Wavefront OBJ: vertices and faces; materials and everything else are ignored.

Our own reader: trimesh's counts negative indices from the last vertex of the file, not from the last one
read, cuts concave polygons into fans that fold over themselves, and drops a mesh with a damaged vertex line
without an error.
"""

from __future__ import annotations

import numpy as np

from mskgrasp.parts.importing.formats import Loaded, Unreadable
from mskgrasp.parts.importing.formats.polygons import triangulated
from mskgrasp.parts.solids.surface import Surface


def load_obj(content: bytes) -> Loaded:
    """Read an OBJ; its unit is unknown. Polygons are triangulated.

    Raises:
        Unreadable: A line is damaged, or there are no vertices.
    """
    vertices: list[list[bytes]] = []
    faces: list[tuple[int, int, int]] = []
    polygons: list[list[int]] = []
    # Names may be in any encoding; all that is read is ASCII.
    lines = content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]
                vertices.append([x, y, z])
                continue
            corners = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            if 0 in corners:
                raise ValueError("vertices are counted from 1")
        except ValueError as error:
            text = line.decode("ascii", "replace").strip()[:40]
            raise Unreadable(
                f"is not a readable OBJ (line {number}: {text!r}): export it again from the CAD program"
            ) from error
        # Counted from 1, or backwards from the vertex read last.
        corners = [corner - 1 if corner > 0 else len(vertices) + corner for corner in corners]
        if len(corners) == 3:
            faces.append((corners[0], corners[1], corners[2]))
        elif len(corners) > 3:
            polygons.append(corners)
    if not vertices:
        raise Unreadable("holds no vertices (not an OBJ?): export it again as OBJ")
    points = np.array(vertices, dtype="S").astype(np.float64)
    pieces = [np.array(faces, dtype=np.int64).reshape(-1, 3)]
    pieces += [triangulated(points, np.array(corners)) for corners in polygons]
    return Loaded(objects=(Surface(vertices=points, faces=np.concatenate(pieces)),))
