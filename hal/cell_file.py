"""Values in the text of a cell's file, of which all else stays as it is."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.core.files import write_whole


def with_values(text: str, section: str, values: Mapping[str, str], *, after: str) -> str:
    """Text of a cell's file with other values in a section; comments and order stay.

    Args:
        text: Its YAML.
        section: Name of the section, a mapping.
        values: New values as YAML, by key. A key that the section lacks is added.
        after: Key that the section has; new ones follow it.

    Raises:
        BadConfig: The section lacks that key.
    """
    mapping = _value(yaml.compose(text, Loader=yaml.SafeLoader), section)
    anchor = _value(mapping, after)
    if anchor is None:
        raise BadConfig(f"the file has no {section}.{after}; write '{after}: null' there")
    replacements, added = [], ""
    column = next(key for key, _ in mapping.value if key.value == after).start_mark.column
    for key, new in values.items():
        node = _value(mapping, key)
        if node is not None:
            begin, end = node.start_mark.index, _end(node)
            replacements.append((begin, end, new if begin < end else f" {new}"))
        else:
            added += f", {key}: {new}" if mapping.flow_style else f"\n{' ' * column}{key}: {new}"
    place = _end(anchor)
    if not mapping.flow_style:
        end_of_line = text.find("\n", place)
        place = end_of_line if end_of_line >= 0 else len(text)
    # From the end to the beginning; what is added behind an empty value goes in before it.
    edits = [(place, 1, place, added), *((begin, 0, end, new) for begin, end, new in replacements)]
    for begin, _, end, piece in sorted(edits, reverse=True):
        text = text[:begin] + piece + text[end:]
    return text


def write_values(path: Path, section: str, values: Mapping[str, str], *, after: str) -> None:
    """Write values into a section of a cell's file, atomically; arguments as of `with_values`.

    Raises:
        BadConfig: The file cannot be rewritten; it is as before.
    """
    new = _edited(path, section, values, after)
    if new is None:
        by_hand = ", ".join(f"{key}: {value}" for key, value in values.items())
        raise BadConfig(f"{path}: the text cannot be edited; write {by_hand} into {section} by hand")
    write_whole(path.resolve(), new)  # a link stays a link


def _edited(path: Path, section: str, values: Mapping[str, str], after: str) -> bytes | None:
    """The file with other values; None where editing its text would not set these alone."""
    stored = path.read_bytes().decode()
    line_end = "\r\n" if "\r\n" in stored else "\n"
    text = stored.replace("\r\n", "\n")
    try:
        new = with_values(text, section, values, after=after)
    except BadConfig as error:
        raise BadConfig(f"{path}: {error}") from error
    before, found = yaml.safe_load(text), _load(new)
    told = {key: yaml.safe_load(value) for key, value in values.items()}
    expected = {**before, section: {**before[section], **told}}
    return new.replace("\n", line_end).encode() if found == expected else None


def require_writable(path: Path, what: str, section: str, values: Mapping[str, str], *, after: str) -> None:
    """Refuse a cell's file that cannot be rewritten, before anything is measured.

    Args:
        path: The file.
        what: Measurement that is written there, for the message.
        section: As of `with_values`.
        values: Likewise; those that are written later may be others.
        after: Likewise.

    Raises:
        UsageError: The file or its folder is not writable.
        BadConfig: Its text cannot be edited.
    """
    if not (os.access(path, os.W_OK) and os.access(path.resolve().parent, os.W_OK)):
        raise UsageError(f"{path} is not writable; {what} is written there: copy the file, give the copy")
    if _edited(path, section, values, after) is None:
        raise BadConfig(
            f"{path}: {what} could not be written into {section}, whose text stands for other places, too; "
            "write the section out, without an alias (*)"
        )


def number(value: float, digits: int = 5) -> str:
    """A number as YAML without an exponent: YAML 1.1 takes 1e-05 for text."""
    text = f"{value:.{digits}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text


def _load(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return None


def _end(node: yaml.Node) -> int:
    """Index behind a value; what PyYAML takes for the end of a block is the beginning of what follows."""
    if isinstance(node, yaml.MappingNode) and not node.flow_style and node.value:
        return _end(node.value[-1][1])
    if isinstance(node, yaml.SequenceNode) and not node.flow_style and node.value:
        return _end(node.value[-1])
    return node.end_mark.index


def _value(mapping: Any, name: str) -> Any:
    """Node of a key of a mapping's node; None without one."""
    if not isinstance(mapping, yaml.MappingNode):
        return None
    return next((value for key, value in mapping.value if key.value == name), None)
