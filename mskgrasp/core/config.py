"""Configuration files in YAML and the frozen pydantic models that they are checked against."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from mskgrasp.core.errors import BadConfig, one_line, shown
from mskgrasp.core.files import read_bounded, write_whole
from mskgrasp.core.yaml_text import parse_yaml

MOST_BYTES = 2**20
"""Largest configuration file; one that names all 2328 parts of a catalogue has 50 kB."""
_MOST_PROBLEMS = 4
"""Problems of one file that a message lists."""
_LONGEST_KEY = 100
"""Characters of a wrong key that a message shows."""


class Config(BaseModel):
    """Base of every configuration: frozen, numbers are finite, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


ConfigT = TypeVar("ConfigT", bound=BaseModel)


def read_yaml(path: Path, most_bytes: int = MOST_BYTES) -> dict[str, Any]:
    """Read a YAML file that holds a mapping; an empty file holds an empty mapping.

    Args:
        path: The file.
        most_bytes: A larger one is refused.

    Raises:
        BadConfig: The file is missing, too large, is not YAML, or does not hold a mapping.
    """
    try:
        text = read_bounded(path, most_bytes).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise BadConfig(
            f"cannot read configuration {path}: {_reason(error)}; name a readable YAML file, such as those "
            "in configs/"
        ) from error
    try:
        values = parse_yaml(text)
    except ValueError as error:
        raise BadConfig(f"{path} is not valid YAML: {error}") from error
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise BadConfig(f"{path}: expected a mapping of keys to values, got {type(values).__name__}")
    return values


def read_config(model: type[ConfigT], path: Path) -> ConfigT:
    """Read a YAML file as a configuration.

    Raises:
        BadConfig: The file is missing, does not hold a YAML mapping, or does not fit the model.
    """
    return check_config(model, read_yaml(path), str(path))


def _key(location: tuple[int | str, ...]) -> str:
    return f"'{'.'.join(map(str, location))}'"


def check_config(
    model: type[ConfigT],
    values: Any,
    source: str,
    *,
    name: Callable[[tuple[int | str, ...]], str] = _key,
) -> ConfigT:
    """Validate plain values as a configuration.

    Args:
        model: Class of the configuration.
        values: A mapping of plain values.
        source: Their origin, for messages.
        name: Gives the name of a value in messages from its location.

    Raises:
        BadConfig: The values do not fit the model; the message names the key and the legal ones.
    """
    if not isinstance(values, dict):
        raise BadConfig(f"{source}: expected a mapping of keys to values, got {type(values).__name__}")
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise BadConfig(f"{source}: {_explain(model, error, name)}") from error


def write_config(config: BaseModel, path: Path) -> None:
    """Write the resolved configuration as YAML, so that a run can be repeated from its output."""
    write_whole(path, yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False).encode())


def _explain(
    model: type[BaseModel], error: ValidationError, name: Callable[[tuple[int | str, ...]], str]
) -> str:
    problems = []
    # Unknown keys first: a misspelt key is why another is missing.
    found = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    # Of values that a list lacks the last one tells how many are needed.
    lacking = {detail["loc"][:-1]: detail for detail in found if _lacks_an_item(detail)}
    found = [one for one in found if not _lacks_an_item(one) or one is lacking[one["loc"][:-1]]]
    listed = found[:_MOST_PROBLEMS]
    for number, detail in enumerate(listed):
        key = name(detail["loc"]) + ": " if detail["loc"] else ""
        if detail["type"] == "extra_forbidden":
            key = name(detail["loc"])
            key = key if len(key) <= _LONGEST_KEY else f"{key[:_LONGEST_KEY]}..."
            place = detail["loc"][:-1]
            legal = ", ".join(sorted(_fields_at(model, place)))
            # Once for all keys of a place.
            later = any(
                (one["type"], one["loc"][:-1]) == (detail["type"], place) for one in listed[number + 1 :]
            )
            problems.append(
                f"unknown key {key}" + (f"; legal keys here: {legal}" if legal and not later else "")
            )
        elif _lacks_an_item(detail):
            *place, last = detail["loc"]
            problems.append(
                f"{name(tuple(place))}: {int(last) + 1} values are needed, got {len(detail['input'])}"
            )
        elif detail["type"] in ("union_tag_invalid", "union_tag_not_found"):
            context = detail.get("ctx", {})
            tag = context.get("discriminator", "'type'").strip("'")
            legal = ", ".join(_members(_annotation_at(model, detail["loc"]), tag))
            given = f"unknown {tag} '{context['tag']}'" if "tag" in context else f"{tag} is missing"
            problems.append(f"{key}{given}; legal: {legal}")
        else:
            value = detail.get("input")
            given = "" if detail["type"] == "missing" or isinstance(value, dict) else f", got {shown(value)}"
            cause = detail.get("ctx", {}).get("error")  # of a validator in this project
            problems.append(f"{key}{cause or detail['msg'].lower()}{given}")
    if len(found) > _MOST_PROBLEMS:
        problems.append(f"and {len(found) - _MOST_PROBLEMS} more")
    return one_line("; ".join(problems))


def _lacks_an_item(detail: ErrorDetails) -> bool:
    return detail["type"] == "missing" and bool(detail["loc"]) and isinstance(detail["loc"][-1], int)


def _fields_at(model: type[BaseModel], location: tuple[int | str, ...]) -> set[str]:
    return set(getattr(_annotation_at(model, location), "model_fields", {}))


def _annotation_at(model: type[BaseModel], location: tuple[int | str, ...]) -> Any:
    """The type at a location of an error; within a tagged union, a location names the member by its tag."""
    current: Any = model
    discriminator = None
    for part in location:
        if discriminator is not None:
            current, discriminator = _members(current, discriminator).get(str(part)), None
            continue
        if isinstance(part, int):  # an item of a tuple
            item = next(iter(get_args(current)), None)
            current, *notes = get_args(item) or (item,)
            tags = (one.discriminator for one in notes if isinstance(one, FieldInfo))
            discriminator = next((tag for tag in tags if isinstance(tag, str)), None)
            continue
        field = getattr(current, "model_fields", {}).get(part)
        if field is None:
            return None
        current, discriminator = field.annotation, field.discriminator
    return current


def _members(union: Any, discriminator: str) -> dict[str, type[BaseModel]]:
    """Members of a tagged union by their tags."""
    tags = ((get_args(member.model_fields[discriminator].annotation), member) for member in get_args(union))
    return {str(tag): member for legal, member in tags for tag in legal}


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
