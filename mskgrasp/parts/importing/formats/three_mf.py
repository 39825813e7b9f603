"""3MF: a zip of XML, by the 3MF core specification 1.3 and its production extension.

Our own reader: trimesh's unpacks the whole archive (1.1 GB of memory for a file of 0.4 MB), merges
objects of several model files that share an id, takes supports for the part, drops references to missing
objects without an error, and checks neither a DTD nor required extensions.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from array import array
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

import numpy as np

from mskgrasp.parts.importing.formats import MOST_TRIANGLES, Loaded, Unreadable
from mskgrasp.parts.solids.surface import Surface

MOST_UNPACKED = 1 << 30
"""Largest unpacked size of the archive, bytes."""

_MOST_INSTANCES = 10_000
_DEEPEST = 32

# Core specification, section 3.4: millimetres by default.
_UNITS = {
    "micron": ("micron", 1e-3),
    "millimeter": ("mm", 1.0),
    "centimeter": ("cm", 10.0),
    "inch": ("in", 25.4),
    "foot": ("ft", 304.8),
    "meter": ("m", 1000.0),
}
_FOREIGN = ("beamlattice", "securecontent", "volumetric", "boolean")
"""Extensions that describe the shape by something other than triangles, by a word of their namespace."""

_SPACE = " "
"""Between namespace and name of an element or attribute, as expat reports them."""

_Key = tuple[str, str]


@dataclass
class _Object:
    kind: str = "model"
    vertices: array[float] = field(default_factory=lambda: array("d"))
    faces: array[int] = field(default_factory=lambda: array("q"))
    components: list[tuple[_Key, np.ndarray]] = field(default_factory=list)


class _Model:
    """Content of one ``.model`` file of the archive."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.unit: str | None = None
        """As the file states it; by the specification millimetres where none does."""
        self.objects: dict[_Key, _Object] = {}
        self.items: list[tuple[_Key, np.ndarray]] = []
        self._current = _Object()
        self._core: str | None = None
        self._namespaces: dict[str, str] = {}

    def declare(self, prefix: str | None, namespace: str | None) -> None:
        """Note a prefix, which expat reports before the element that declares it."""
        self._namespaces[prefix or ""] = namespace or ""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Read an element of the core specification; the root is one in every version of it.

        Extensions have elements of the same names: a ``vertex`` of the slice extension has no z.
        """
        namespace, _, local = name.rpartition(_SPACE)
        if self._core is None:
            self._core = namespace
        if namespace != self._core:
            return
        match local:
            case "vertex":
                self._current.vertices.extend(float(attributes[axis]) for axis in "xyz")
            case "triangle":
                self._current.faces.extend(int(attributes[corner]) for corner in ("v1", "v2", "v3"))
            case "object":
                self._current = _Object(kind=attributes.get("type", "model"))
                self.objects[self.file, attributes["id"]] = self._current
            case "component":
                self._current.components.append((self._key(attributes), _matrix(attributes)))
            case "item":
                self.items.append((self._key(attributes), _matrix(attributes)))
            case "model":
                self.unit = attributes.get("unit")
                self._check_extensions(attributes)

    def _key(self, attributes: dict[str, str]) -> _Key:
        path = next(
            (value for key, value in attributes.items() if key.rpartition(_SPACE)[2] == "path"), self.file
        )
        return path.lstrip("/"), attributes["objectid"]

    def _check_extensions(self, attributes: dict[str, str]) -> None:
        for prefix in attributes.get("requiredextensions", "").split():
            namespace = self._namespaces.get(prefix, "")
            if any(word in namespace for word in _FOREIGN):
                raise Unreadable(f"needs the 3MF extension {namespace}: export it as a plain mesh")


def load_3mf(content: bytes) -> Loaded:
    """Read the build items of a 3MF, each instance in its place, in the unit that the file states.

    Raises:
        Unreadable: It is damaged, unpacks to more than 1 GiB, or is not made of triangles.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            models = _models(archive)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise Unreadable(f"is not a readable 3MF ({error}): export or copy it again") from error
    except expat.ExpatError as error:
        raise Unreadable(f"is not a readable 3MF (XML: {error}): export it again") from error
    except (KeyError, ValueError, OverflowError) as error:
        raise Unreadable(
            f"is not a readable 3MF (bad or missing attribute {error}): export it again"
        ) from error
    root = models[0]
    unit = root.unit or "millimeter"
    if unit not in _UNITS:
        raise Unreadable(f"states the unit {unit!r}, 3MF knows {', '.join(_UNITS)}: export it again")
    units = {model.unit for model in models if model.unit} | {unit}
    if len(units) > 1:
        raise Unreadable(f"states several units, {' and '.join(sorted(units))}: export it again")
    objects = {key: item for model in models for key, item in model.objects.items()}
    surfaces, skipped = _placed(root, objects)
    name, length = _UNITS[unit]
    notes = (f"left out {skipped} support object{'s' if skipped > 1 else ''}",) if skipped else ()
    return Loaded(objects=tuple(surfaces), unit=name, unit_mm=length, notes=notes)


def _models(archive: zipfile.ZipFile) -> list[_Model]:
    """The main model, then the other models of the archive."""
    entries = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > MOST_UNPACKED:
        raise Unreadable(
            f"unpacks to {unpacked / 2**30:.1f} GiB, the most is {MOST_UNPACKED >> 30}: export it coarser"
        )
    main = [entry for entry in entries if entry.filename.lower().lstrip("/") == "3d/3dmodel.model"]
    if not main:
        raise Unreadable("is not a readable 3MF (3D/3dmodel.model is missing): export it again")
    models = []
    for entry in [main[0], *(entry for entry in entries if entry is not main[0])]:
        model = _Model(entry.filename.lstrip("/"))
        parser = expat.ParserCreate(namespace_separator=_SPACE)
        parser.buffer_text = True
        parser.StartElementHandler = model.start
        parser.StartNamespaceDeclHandler = model.declare
        # The core specification forbids a DTD; its entities could expand without limit.
        parser.StartDoctypeDeclHandler = _refuse_dtd
        with archive.open(entry) as file:
            parser.ParseFile(file)
        models.append(model)
    return models


def _placed(root: _Model, objects: dict[_Key, _Object]) -> tuple[list[Surface], int]:
    """Surfaces of the build items with components resolved, and the number of support objects left out."""
    surfaces: list[Surface] = []
    pending = [(key, matrix, 0) for key, matrix in reversed(root.items)]
    skipped = total = steps = 0
    while pending:
        key, matrix, depth = pending.pop()
        steps += 1
        if depth > _DEEPEST or steps > _MOST_INSTANCES:
            raise Unreadable(
                f"nests over {_DEEPEST} components or places over {_MOST_INSTANCES:,}: export one part alone"
            )
        if key not in objects:
            raise Unreadable(f"refers to the missing object {key[1]!r}: export it again")
        item = objects[key]
        if item.kind in ("support", "solidsupport"):
            skipped += 1
            continue
        if item.faces:
            total += len(item.faces) // 3
            if total > MOST_TRIANGLES:
                raise Unreadable(f"places over {MOST_TRIANGLES:,} triangles: export one part alone")
            surfaces.append(_surface(item, matrix))
        pending += [(child, local @ matrix, depth + 1) for child, local in reversed(item.components)]
    return surfaces, skipped


def _surface(item: _Object, matrix: np.ndarray) -> Surface:
    points = np.frombuffer(item.vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.frombuffer(item.faces, dtype=np.int64).reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]  # a mirrored instance is wound the other way round
    return Surface(vertices=points @ matrix[:3, :3] + matrix[3, :3], faces=faces)


def _matrix(attributes: dict[str, str]) -> np.ndarray:
    """(4, 4) for row vectors, as the core specification writes transforms (section 3.3)."""
    matrix = np.eye(4)
    if "transform" in attributes:
        values = [float(word) for word in attributes["transform"].split()]
        matrix[:, :3] = np.reshape(values, (4, 3))
    return matrix


def _refuse_dtd(*_: Any) -> None:
    raise Unreadable("has a DTD, which 3MF forbids: export it again")
