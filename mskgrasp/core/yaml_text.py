"""Parsing of YAML text that may be malformed or malicious."""

from __future__ import annotations

from typing import Any

import yaml

MOST_DEPTH = 50
"""Most collections inside each other."""
MOST_ALIASES = 100
MOST_CHARACTERS = 1000
"""Most characters of a number: one of minutes and seconds takes time that grows with their square, and one of
5000 hexadecimal digits cannot be shown."""
MOST_VALUES = 200_000
"""Most keys and values, those that aliases stand for counted as often as they are used."""
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with bounds, checked before values are made, and without duplicate keys.

    A few aliases of aliases can stand for more values than fit into memory, and PyYAML's recursion ends in a
    RecursionError: neither is known to be a problem of the text.
    """

    def __init__(self, text: str):
        super().__init__(text)
        self._depth = self._n_aliases = self._n_values = 0
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        before = self._n_values
        self._depth += 1
        if self._depth > MOST_DEPTH:
            self._refuse(f"more than {MOST_DEPTH} collections inside each other", event)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if isinstance(event, yaml.AliasEvent):
            self._n_aliases += 1
            if self._n_aliases > MOST_ALIASES:
                self._refuse(f"more than {MOST_ALIASES} aliases", event)
            if id(node) not in self._sizes:
                self._refuse("a value that contains itself", event)
            self._n_values += self._sizes[id(node)]
        else:
            self._n_values += 1
            self._sizes[id(node)] = self._n_values - before
        if self._n_values > MOST_VALUES:
            self._refuse(f"more than {MOST_VALUES} values", event)
        return node

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        known: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in known:
                    self._refuse(f"key {key.value!r} occurs twice", key)
                known.add((key.tag, key.value))
        return node

    def compose_scalar_node(self, anchor: Any) -> yaml.ScalarNode:
        node = super().compose_scalar_node(anchor)
        if len(node.value) > MOST_CHARACTERS and node.tag in _NUMBERS:
            self._refuse(f"a number of more than {MOST_CHARACTERS} characters", node)
        return node

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except ValueError as error:
            self._refuse(str(error), node)
        except (LookupError, AttributeError):  # of PyYAML, where a tag is written that does not fit
            self._refuse("a value that does not have the form of its tag", node)

    @staticmethod
    def _refuse(problem: str, at: Any) -> None:
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)


def parse_yaml(text: str) -> Any:
    """Parse one YAML document of plain values.

    Raises:
        ValueError: It is not valid, has too many values, aliases or levels, or a key twice; the message names
            the line.
    """
    try:
        loader = _Loader(text)
        try:
            return loader.get_single_data()
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "syntax error"
        raise ValueError(f"{problem}{where}") from error
