"""STEP, tessellated by OpenCASCADE through cascadio."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys

from mskgrasp.parts.importing.formats import Loaded, Unreadable
from mskgrasp.parts.importing.formats.glb import load_glb

TOLERANCE_MM = 0.02
"""Largest distance of a triangle from the true surface."""

ANGLE_RAD = 0.1
"""Largest angle between neighbouring facets: 63 in a circle, which then has 0.17 % less area."""

_COARSEST = 1e-3
"""Largest step between coordinates of its triangles, by its length: about `TOLERANCE_MM`."""

LIMIT_S = 300.0

_PROGRAM = """
import os, sys
out = os.dup(1)
os.dup2(2, 1)  # OpenCASCADE prints to standard output
import cascadio
glb = cascadio.load(
    sys.stdin.buffer.read(), file_type="step", tol_linear=float(sys.argv[1]), tol_angular=float(sys.argv[2]),
    tol_relative=False, merge_primitives=True, use_parallel=False,
)
with os.fdopen(out, "wb") as file:
    file.write(glb)
"""

_UNITS = {b"MILLI": ("mm", 1.0), b"CENTI": ("cm", 10.0), b"MICRO": ("micrometre", 1e-3), b"": ("m", 1000.0)}


def load_step(content: bytes) -> Loaded:
    """Read the solids of a STEP file, in the unit that the file states.

    Raises:
        Unreadable: It is damaged, has no solids, is too far from its origin, or cascadio is not installed.
    """
    if importlib.util.find_spec("cascadio") is None:
        raise Unreadable("is STEP, which needs an extra: run EXTRAS=dev,cad .ci/setup")
    if b"ISO-10303-21" not in content[:4096]:
        raise Unreadable("is not a STEP file (ISO-10303-21 is missing at its head): export it again as STEP")
    if b"END-ISO-10303-21" not in content[-4096:]:
        raise Unreadable("is cut off: END-ISO-10303-21 is missing at its end; export or copy it again")
    try:
        # In a separate process: a file that crashes OpenCASCADE or hangs does not affect other files.
        done = subprocess.run(
            [sys.executable, "-I", "-c", _PROGRAM, str(TOLERANCE_MM), str(ANGLE_RAD)],
            input=content,
            capture_output=True,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise Unreadable(
            f"was not tessellated within {LIMIT_S:.0f} s: simplify it, or export it as STL"
        ) from error
    if done.returncode or not done.stdout:
        raise Unreadable(
            f"is not a readable STEP ({_reason(done.stderr)}): export it again as STEP or as STL"
        )
    loaded = load_glb(done.stdout, coarsest=_COARSEST)
    name, length = _stated_unit(content)
    # cascadio gives metres in any case; a file is returned in its own unit.
    objects = tuple(
        type(item)(vertices=item.vertices * (1000.0 / length), faces=item.faces) for item in loaded.objects
    )
    return Loaded(objects=objects, unit=name, unit_mm=length)


def _stated_unit(content: bytes) -> tuple[str, float]:
    if re.search(rb"CONVERSION_BASED_UNIT\s*\(\s*'INCH", content, re.IGNORECASE):
        return "in", 25.4
    found = re.search(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.\s*\)", content)
    return _UNITS.get(found.group(1) or b"", ("mm", 1.0)) if found else ("mm", 1.0)


def _reason(printed: bytes) -> str:
    text = re.sub(r"\x1b\[[0-9;]*m|\*{2,}", "", printed.decode("utf-8", "replace"))
    lines = [" ".join(line.split()) for line in text.splitlines() if line.strip()]
    return lines[0][:120] if lines else "OpenCASCADE gave no reason"
