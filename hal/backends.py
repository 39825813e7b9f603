"""Backends of installed packages, found by name among their entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Literal, TypeVar

from hal.arm import Arm
from hal.camera import Camera
from hal.cell import Cell
from hal.errors import BadBackend
from hal.limits import ArmLimits
from mskgrasp.core.config import Config, check_config
from mskgrasp.core.errors import BadConfig, MskgraspError, first_line

Group = Literal["arms", "cameras", "cells", "planners"]
DeviceT = TypeVar("DeviceT", Arm, Camera, Cell)


@dataclass(frozen=True, kw_only=True)
class Backend:
    """Arm, camera or cell of another package, named by an entry point of the group ``mskgrasp.arms`` etc.

    Attributes:
        config: Class of its settings. The section of the file, without ``driver`` or ``type``, is checked
            against it.
        make: Builds the device from the settings and, for an arm, the checked `WorkspaceConfig`, from whose
            ``limits`` it has its limits; for a camera or a cell, the path of the cell's file, next to which
            files that it names lie. Nothing is connected yet.
    """

    config: type[Config]
    make: Callable[[Any, Any], Any]


def find_backend(name: Any, group: Group, built_in: tuple[str, ...], key: str) -> EntryPoint | None:
    """The entry point of that name; None for a built-in backend.

    Args:
        name: As in the file.
        group: Kind of the backend.
        built_in: Names of those that are built in.
        key: File and key that hold the name, for messages.

    Raises:
        BadConfig: Nothing has that name; the message lists all and where they come from.
        BadBackend: Several have that name.
    """
    found = entry_points(group=f"mskgrasp.{group}")
    owners = [f"package {_package(entry)}" for entry in found if entry.name == name]
    if name in built_in:
        owners.insert(0, "this program")
    if len(owners) > 1:
        raise BadBackend(
            f"{key} {name!r} is offered by {' and by '.join(owners)}; uninstall all but one, or have its "
            "package rename it"
        )
    if not owners:
        others = sorted(f"{entry.name} (package {_package(entry)})" for entry in found)
        legal = ", ".join(built_in) + " (built in)"
        given = "missing" if name is None else repr(name)
        raise BadConfig(f"{key} is {given}; legal: {', '.join([legal, *others])}")
    return None if name in built_in else next(entry for entry in found if entry.name == name)


def build(
    entry: EntryPoint, kind: type[DeviceT], values: dict[str, Any], source: str, context: Any
) -> DeviceT:
    """Build the device of an installed package; nothing is connected yet.

    Args:
        entry: From `find_backend`.
        kind: `Arm`, `Camera` or `Cell`.
        values: Its section of the file.
        source: File and section, for messages.
        context: Second argument of `Backend.make`.

    Raises:
        BadConfig: The section does not fit the package's settings.
        BadBackend: The package fails, or offers something else.
    """
    named = f"{entry.name} of package {_package(entry)} ({entry.value})"
    try:
        backend = entry.load()
    except (Exception, SystemExit) as error:
        raise BadBackend(
            f"{named} cannot be imported: {first_line(error)}; repair or uninstall it"
        ) from error
    if not (
        isinstance(backend, Backend)
        and isinstance(backend.config, type)
        and issubclass(backend.config, Config)
        and callable(backend.make)
    ):
        raise BadBackend(
            f"{named} must be a hal.Backend of a hal.BackendConfig and a function, and is {_shown(backend)}"
        )
    section = {key: value for key, value in values.items() if key not in ("driver", "type")}
    config = check_config(backend.config, section, source)
    try:
        device = backend.make(config, context)
    except MskgraspError:
        raise
    except Exception as error:
        raise BadBackend(f"{named} cannot be built: {first_line(error)}") from error
    _check(device, kind, named)
    return device


def package_of(name: str, group: Group) -> str | None:
    """Package and version that offer a backend; None for one that is not installed."""
    return next((_package(entry) for entry in entry_points(group=f"mskgrasp.{group}", name=name)), None)


def _check(device: Any, kind: type, named: str) -> None:
    """Refuse what breaks the contract in a way that shows before anything is connected."""
    if not isinstance(device, kind):
        raise BadBackend(f"{named} must build a hal.{kind.__name__}, and builds one {_shown(device)}")
    if isinstance(device, Cell):
        _check(device.arm, Arm, f"the arm of {named}")
        _check(device.camera, Camera, f"the camera of {named}")
    elif isinstance(device, Arm) and not isinstance(getattr(device, "limits", None), ArmLimits):
        raise BadBackend(f"{named} has no limits; its constructor must call super().__init__(limits)")


def _package(entry: EntryPoint) -> str:
    return "unknown" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


def _shown(value: Any) -> str:
    return f"the class {value.__name__}" if isinstance(value, type) else f"of type {type(value).__name__}"
