"""Values of a YAML or JSON file that know where they stand, so that an error can say so."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import yaml

from cagefield.errors import EditFileError
from cagefield.files import json_text, yaml_text
from cagefield.files.yaml_text import MAX_NESTING, MAX_VALUES

_LONGEST_PATH = 120
"""Characters of a key path in a message."""


@dataclass(frozen=True, slots=True)
class Node:
    """A value, with its file, line (0 where unknown) and key path.

    `value` is a dict of nodes by key, a list of nodes, or a str, int, float, bool or None; `raw` is what a
    plain YAML scalar looks like in the file.
    """

    value: Any
    source: str
    line: int
    path: str
    raw: str | None = None

    def error(self, message: str) -> EditFileError:
        """An `EditFileError` that says where this value stands."""
        where = f"{self.source}, line {self.line}" if self.line else self.source
        path = self.path if len(self.path) <= _LONGEST_PATH else f"...{self.path[-_LONGEST_PATH:]}"
        return EditFileError(f"{where}: {path}: {message}" if path else f"{where}: {message}")

    @property
    def is_list(self) -> bool:
        """True for a list."""
        return isinstance(self.value, list)

    @property
    def is_mapping(self) -> bool:
        """True for a mapping."""
        return isinstance(self.value, dict)

    @property
    def is_null(self) -> bool:
        """True for null."""
        return self.value is None

    def names(self) -> list[str]:
        """The keys of a mapping; none for anything else."""
        return list(self.value) if isinstance(self.value, dict) else []

    def mapping(self, required: Sequence[str] = (), optional: Sequence[str] = ()) -> dict[str, Node]:
        """A copy of a mapping that has the required keys and no others but the optional ones."""
        if not isinstance(self.value, dict):
            raise self.error(f"expected keys ({', '.join((*required, *optional))}), got {self._shown}")
        allowed = (*required, *optional)
        for key, node in self.value.items():
            if key not in allowed:
                near = difflib.get_close_matches(str(key)[:40], allowed, n=1, cutoff=0.6)
                hint = f'; did you mean "{near[0]}"?' if near else f"; the keys here are {', '.join(allowed)}"
                raise node.error(f"unknown key {_quoted(key)}{hint}")
        for key in required:
            if key not in self.value:
                raise self.error(f'"{key}" is missing')
        return dict(self.value)

    def items(self, length: int | None = None) -> list[Node]:
        """The items of a list, of the given length if one is given."""
        if not isinstance(self.value, list):
            raise self.error(f"expected a list, got {self._shown}")
        if length is not None and len(self.value) != length:
            raise self.error(f"expected {length} items, got {len(self.value)}")
        return list(self.value)

    def number(self) -> float:
        """A finite number."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(f"expected a number, got {self._shown}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(f"numbers must be finite, got {number}")
        return number

    def integer(self, low: int, high: int) -> int:
        """A whole number from low to high."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or not low <= self.value <= high:
            raise self.error(f"expected a whole number from {low} to {high}, got {self._shown}")
        return self.value

    def vector(self) -> tuple[float, float, float]:
        """Three finite numbers."""
        x, y, z = (item.number() for item in self.items(3))
        return x, y, z

    def factors(self) -> tuple[float, float, float]:
        """One number or three, each > 0."""
        values = self.vector() if self.is_list else (self.number(),) * 3
        for value in values:
            if value <= 0.0:
                raise self.error(f"must be positive, got {value:g}")
        return values

    def boolean(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            raise self.error(f"expected true or false, got {self._shown}")
        return self.value

    def text(self) -> str:
        """A string; an unquoted YAML scalar stands for itself, as in `name: 7`."""
        if self.raw is not None and self.value is not None:
            return self.raw
        if not isinstance(self.value, str):
            raise self.error(f"expected text, got {self._shown}")
        return self.value

    def choice(self, values: Sequence[str]) -> str:
        """One of some words."""
        if self.value not in values:
            near = difflib.get_close_matches(str(self.value)[:40], values, n=1)
            hint = f'; did you mean "{near[0]}"?' if near else ""
            raise self.error(f"must be {' or '.join(values)}, got {self._shown}{hint}")
        return str(self.value)

    @property
    def _shown(self) -> str:
        if isinstance(self.value, dict):
            return "keys"
        if isinstance(self.value, list):
            return "a list"
        return "nothing" if self.value is None else _quoted(self.value)


def read_yaml(text: str, source: str, *, halves: bool = False) -> Node:
    r"""The root of a YAML text; only plain values are built, whatever tags it carries.

    With `halves` it may have escapes of half characters, such as "\ud800".
    """
    try:
        root = yaml_text.compose(text, halves=halves)
    except yaml_text.YamlError as error:
        raise Node(None, source, error.line, "").error(str(error)) from None
    if root is None:
        raise Node(None, source, 0, "").error('the file is empty; it needs "edits:" and a list')
    return _from_yaml(root, source, "")


def read_json(text: str, source: str) -> Node:
    """The root of a JSON text."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, value in pairs:
            if key in found:
                raise Node(None, source, 0, "").error(f"key {_quoted(key)} is given twice; remove one")
            found[key] = value
        return found

    try:
        value = json_text.loads(text, unique, finite=False)
    except json.JSONDecodeError as error:
        raise Node(None, source, error.lineno, "").error(f"not valid JSON: {error.msg}") from None
    except EditFileError:
        raise
    except ValueError as error:  # nested too deeply, a number of thousands of digits
        raise Node(None, source, 0, "").error(f"cannot be read: {error}") from None
    return _from_json(value, source, "", 0, [MAX_VALUES])


def write_yaml(content: Any) -> str:
    """YAML text with lists of numbers on one line and floats that read back bit for bit."""
    return str(yaml.dump(content, Dumper=_Dumper, sort_keys=False, width=100, allow_unicode=True))


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _short_lists(dumper: yaml.SafeDumper, data: list[Any]) -> yaml.Node:
    flow = all(isinstance(item, (int, float)) for item in data)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=flow)


def _short_mappings(dumper: yaml.SafeDumper, data: dict[str, Any]) -> yaml.Node:
    short = {"center", "margin", "by", "corner", "edge", "face", "xy", "xz", "yx", "yz", "zx", "zy"}
    flow = bool(short & data.keys())
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=flow)


_Dumper.add_representer(list, _short_lists)
_Dumper.add_representer(dict, _short_mappings)


def _from_yaml(node: yaml.Node, source: str, path: str) -> Node:
    """The node and everything below it."""
    line = node.start_mark.line + 1
    if isinstance(node, yaml.MappingNode):
        mapping: dict[Any, Node] = {}
        for key_node, value_node in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else "?"
            here = f"{path}.{key}" if path else str(key)
            at = key_node.start_mark.line + 1
            if key in mapping:
                raise Node(None, source, at, here).error(f"key {_quoted(key)} is given twice; remove one")
            # An error about a value is where its key stands, not where a block under it starts.
            mapping[key] = replace(_from_yaml(value_node, source, here), line=at)
        return Node(mapping, source, line, path)
    if isinstance(node, yaml.SequenceNode):
        items = [_from_yaml(item, source, f"{path}[{n}]") for n, item in enumerate(node.value)]
        return Node(items, source, line, path)
    raw = str(node.value) if isinstance(node, yaml.ScalarNode) and not node.style else None
    return Node(_scalar(node, Node(None, source, line, path)), source, line, path, raw)


def _scalar(node: yaml.Node, place: Node) -> Any:
    try:
        value = yaml_text.scalar(node)
    except yaml_text.YamlError as error:
        raise place.error(str(error)) from None
    if isinstance(value, str) and isinstance(node, yaml.ScalarNode) and not node.style:
        # YAML 1.1 takes 1e-3 for text; a person means a number.
        try:
            return float(value) if any(c.isdigit() for c in value) and "_" not in value else value
        except ValueError:
            return value
    if value is None or isinstance(value, (str, int, float)):
        return value
    return str(node.value)  # dates and the like are text here


def _from_json(value: Any, source: str, path: str, depth: int, budget: list[int]) -> Node:
    budget[0] -= 1
    if budget[0] < 0:
        raise Node(None, source, 0, path).error(f"more than {MAX_VALUES} values")
    if depth > MAX_NESTING:
        raise Node(None, source, 0, path).error("nested too deeply")
    if isinstance(value, dict):
        children = {
            key: _from_json(item, source, f"{path}.{key}" if path else key, depth + 1, budget)
            for key, item in value.items()
        }
        return Node(children, source, 0, path)
    if isinstance(value, list):
        items = [_from_json(item, source, f"{path}[{n}]", depth + 1, budget) for n, item in enumerate(value)]
        return Node(items, source, 0, path)
    return Node(value, source, 0, path)


def _quoted(value: object) -> str:
    """A value as a message shows it: in ASCII, and not without end."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**40:
        return "a number of more than 40 digits"
    text = json.dumps(value)
    return text if len(text) <= 80 else f'{text[:77]}..."'
