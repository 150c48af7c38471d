"""YAML as strangers may write it: limits on nesting and values, before anything is built."""

from __future__ import annotations

import re
from typing import Any

import yaml

MAX_VALUES = 250_000
"""Values of a text, aliases followed: seconds to be read."""

MAX_NESTING = 20

_HALF = re.compile(r"\\(u|U0000)[dD][89a-fA-F]")
_Fast: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class YamlError(ValueError):
    """Fault of a YAML text, with its line (0 where unknown)."""

    def __init__(self, problem: str, line: int = 0) -> None:
        super().__init__(problem)
        self.line = line


def compose(text: str, *, halves: bool = False) -> yaml.Node | None:
    r"""The root of a YAML text, None for an empty one; nothing is built of tags.

    With `halves` it may have escapes of half characters, such as "\ud800". Raises YamlError.
    """
    # The fast loader refuses them.
    loader = yaml.SafeLoader if halves and _HALF.search(text) else _Fast
    try:
        _check_extent(text, loader)
        root = yaml.compose(text, Loader=loader)
        if root is not None:
            _count(root, {}, set())
        return root
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        # The fast loader counts the end of the text as a line of its own.
        line = min(mark.line + 1, len(text.splitlines())) if mark else 0
        raise YamlError(f"not valid YAML: {error.problem or error.context}", line) from None
    except (yaml.YAMLError, UnicodeError) as error:
        raise YamlError(f"not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise YamlError("nested too deeply") from None
    except YamlError:
        raise
    except Exception as error:  # the plain loader's parsers of numbers and escapes raise what they happen to
        raise YamlError(f"not valid YAML: {type(error).__name__}") from None


def loads(text: str) -> Any:
    """The value of a YAML text: dicts, lists, and plain values as `scalar` has them. Raises YamlError."""
    root = compose(text)
    return None if root is None else _built(root)


def scalar(node: yaml.Node) -> Any:
    """Value of a scalar: str, int, float, bool, None, or the type of its tag. Raises YamlError."""
    try:
        return yaml.constructor.SafeConstructor().construct_object(node)
    except Exception as error:  # constructors of tags raise anything on values that are not theirs
        problem = getattr(error, "problem", None) or str(error) or type(error).__name__
        raise YamlError(f"cannot be read: {problem}", node.start_mark.line + 1) from None


def _built(node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return {
            key.value if isinstance(key, yaml.ScalarNode) else "?": _built(value) for key, value in node.value
        }
    if isinstance(node, yaml.SequenceNode):
        return [_built(item) for item in node.value]
    return scalar(node)


def _check_extent(text: str, loader: Any) -> None:
    """Raise YamlError for a text nested too deeply or with too many values, aliases not followed."""
    depth = values = 0
    for event in yaml.parse(text, Loader=loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if isinstance(event, yaml.NodeEvent):
            values += 1
        line = event.start_mark.line + 1 if event.start_mark else 0
        if depth > MAX_NESTING + 1:
            raise YamlError("nested too deeply", line)
        if values > 2 * MAX_VALUES:  # keys are events too
            raise YamlError(f"more than {MAX_VALUES} values", line)


def _count(node: yaml.Node, known: dict[int, tuple[int, int]], above: set[int]) -> tuple[int, int]:
    """(values of a node, its depth), aliases followed; each node is looked at once."""
    if id(node) in known:
        return known[id(node)]
    line = node.start_mark.line + 1
    if id(node) in above or len(above) > MAX_NESTING:
        raise YamlError("nested too deeply", line)
    values, depth = 1, 0
    if isinstance(node, yaml.CollectionNode):
        above.add(id(node))
        for item in node.value:
            inner = _count(item[1] if isinstance(item, tuple) else item, known, above)
            values, depth = values + inner[0], max(depth, inner[1] + 1)
        above.discard(id(node))
    if values > MAX_VALUES:
        raise YamlError(f"more than {MAX_VALUES} values", line)
    if depth > MAX_NESTING:
        raise YamlError("nested too deeply", line)
    known[id(node)] = values, depth
    return values, depth
