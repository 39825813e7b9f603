"""Reading of a user's file from its bytes."""

from pathlib import Path

import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.mesh_files import MeshFile, read_mesh


def read(name: str, content: bytes, unit=None) -> MeshFile:
    return read_mesh(Path(name), content, unit)


def volume(file: MeshFile) -> float:
    return sum(item.volume for item in file.objects)


def refusal(name: str, content: bytes, unit=None) -> str:
    with pytest.raises(BadPart) as caught:
        read(name, content, unit)
    message = str(caught.value)
    assert message.startswith(name) and "\n" not in message
    return message
