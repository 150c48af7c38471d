"""Damage to bytes, to numbers and words of texts, and to trees of JSON."""

from __future__ import annotations

import json
import random
import re
import struct
from collections.abc import Callable
from typing import Any

from hostile_values import DEEP, FLOATS, INTEGERS, NUMBERS, WORDS, YAML

Mutator = Callable[[bytes, random.Random], bytes]

_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*")


def flipped(content: bytes, chance: random.Random) -> bytes:
    """Up to eight bits or bytes changed, early ones more often."""
    changed = bytearray(content)
    for _ in range(chance.randint(1, 8) if changed else 0):
        at = chance.randrange(min(len(changed), 400) if chance.random() < 0.6 else len(changed))
        changed[at] = (
            changed[at] ^ 1 << chance.randrange(8) if chance.random() < 0.5 else chance.randrange(256)
        )
    return bytes(changed)


def cut(content: bytes, chance: random.Random) -> bytes:
    """The end, or a piece of the middle, left out."""
    if chance.random() < 0.5:
        return content[: chance.randrange(len(content) + 1)]
    first = chance.randrange(len(content) + 1)
    return content[:first] + content[first + chance.randint(1, 1 << chance.randrange(1, 14)) :]


def repeated(content: bytes, chance: random.Random) -> bytes:
    """A piece twice, or in another place."""
    first = chance.randrange(len(content) + 1)
    piece = content[first : first + chance.randint(1, 200)]
    at = chance.randrange(len(content) + 1)
    return content[:at] + piece + content[at:]


def number_written(content: bytes, chance: random.Random) -> bytes:
    """An integer or a float that means something to readers, over bytes that may be one."""
    code = chance.choice("HIIQQfd")
    value: Any = chance.choice(FLOATS if code in "fd" else INTEGERS)
    if code in "HIQ":
        value &= (1 << 8 * struct.calcsize(code)) - 1
    if code == "f":
        value = min(value, 3.4e38)
    packed = struct.pack(chance.choice("<>") + code, value)
    most = max(1, len(content) - len(packed) + 1)
    at = chance.randrange(min(most, 200) if chance.random() < 0.6 else most)
    at -= at % chance.choice((1, 4))
    return content[:at] + packed + content[at + len(packed) :]


def number_replaced(content: bytes, chance: random.Random) -> bytes:
    """A number of a text is another one."""
    found = list(_NUMBER.finditer(content))
    place = chance.choice(found)
    return content[: place.start()] + chance.choice(NUMBERS).encode() + content[place.end() :]


def word_replaced(content: bytes, chance: random.Random) -> bytes:
    """A word, a key or a value, is another one, or is of half characters and the like."""
    found = list(_WORD.finditer(content))
    place = chance.choice(found)
    new = chance.choice(WORDS).encode() if chance.random() < 0.6 else chance.choice(found).group()
    if chance.random() < 0.1:
        new = chance.choice((b"\xff", b"\xc3(", b"\xed\xa0\x80", b"\x00"))
    return content[: place.start()] + new + content[place.end() :]


def nested(content: bytes, chance: random.Random) -> bytes:
    """A value within many brackets."""
    found = list(_NUMBER.finditer(content))
    place = chance.choice(found)
    depth = chance.choice(DEEP)
    begin, end = chance.choice(((b"[", b"]"), (b'{"a":', b"}")))
    return content[: place.start()] + begin * depth + place.group() + end * depth + content[place.end() :]


def line_moved(content: bytes, chance: random.Random) -> bytes:
    """A line left out, twice, or in another place."""
    lines = content.splitlines(keepends=True)
    line = lines.pop(chance.randrange(len(lines)))
    for _ in range(chance.randrange(3)):
        lines.insert(chance.randrange(len(lines) + 1), line)
    return b"".join(lines)


def tag_written(content: bytes, chance: random.Random) -> bytes:
    """A value of YAML has a tag, an alias, or another form."""
    found = list(_NUMBER.finditer(content))
    place = chance.choice(found)
    return content[: place.start()] + chance.choice(YAML).encode() + content[place.end() :]


def aliases_multiplied(content: bytes, chance: random.Random) -> bytes:
    """The "billion laughs": lists of lists, each named nine times in the next."""
    levels = [b"a0: &a0 [" + b",".join([b"1"] * 9) + b"]"]
    for n in range(1, chance.choice((4, 9, 20))):
        levels.append(b"a%d: &a%d [" % (n, n) + b",".join([b"*a%d" % (n - 1)] * 9) + b"]")
    return b"\n".join(levels) + b"\n" + content


def hostile(chance: random.Random) -> Any:
    """A value that no reader expects."""
    made = chance.randrange(9)
    if made == 0:
        value: Any = []
        for _ in range(chance.choice(DEEP[:3])):
            value = [value]
        return value
    if made == 1:
        return _Raw(chance.choice(NUMBERS))
    if made == 2:
        return chance.choice(("\ud800", "\x00", "", "x" * 10_000, "../..", "/etc/passwd", "1", "true"))
    if made == 3:
        return chance.choice((None, True, False, [], {}, [[]], {"": {}}, [None] * 3))
    if made == 4:
        return [0] * chance.choice((1, 1000, 20_000))
    return chance.choice((0, -1, 1, 0.5, 2**31, 2**53, 10**18, 10**30, 1e308, -1e308, 1e-300, 4096))


class _Raw(float):
    """A number that is written as it was given."""

    def __new__(cls, text: str) -> _Raw:
        made = super().__new__(cls, 0.0)
        made.text = text
        return made

    text: str

    def __repr__(self) -> str:
        return self.text


def dumped(tree: Any) -> bytes:
    """JSON of a tree whose numbers may be `_Raw`."""
    marks: dict[str, str] = {}

    def plain(value: Any) -> Any:
        if isinstance(value, _Raw):
            marks[f"@@{len(marks)}@@"] = value.text
            return f"@@{len(marks) - 1}@@"
        if isinstance(value, dict):
            return {key: plain(item) for key, item in value.items()}
        if isinstance(value, list):
            return [plain(item) for item in value]
        return value

    text = json.dumps(plain(tree))
    for mark, number in marks.items():
        text = text.replace(f'"{mark}"', number)
    return text.encode()


def tree_changed(content: bytes, chance: random.Random) -> bytes:
    """A value of JSON replaced by a hostile one or another one, left out, or under another key."""
    tree = [json.loads(content)]
    places: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            places.append((value, key))
            if isinstance(value[key], (dict, list)):
                walk(value[key])

    walk(tree)
    whole, key = chance.choice(places if chance.random() < 0.7 else places[: max(2, len(places) // 20)])
    how = chance.random()
    if how < 0.6:
        whole[key] = hostile(chance)
    elif how < 0.75:
        other, at = chance.choice(places[1:])
        whole[key] = json.loads(json.dumps(other[at]))
    elif isinstance(whole, dict) and how < 0.9:
        del whole[key]
    elif isinstance(whole, dict):
        whole[chance.choice(("\ud800", "", "1" * 5000, key + " "))] = whole.pop(key)
    elif whole is not tree:
        whole.insert(key, hostile(chance)) if how < 0.9 else whole.pop(key)
    return dumped(tree[0])


def key_doubled(content: bytes, chance: random.Random) -> bytes:
    """A key of JSON twice in its object."""
    found = list(re.finditer(rb'"[^"]{1,40}"\s*:\s*(?:-?[\d.eE+-]+|"[^"]*"|true|false|null)', content))
    place = chance.choice(found)
    return content[: place.end()] + b"," + place.group() + content[place.end() :]


BYTES: tuple[Mutator, ...] = (flipped, flipped, cut, repeated, number_written, number_written)
TEXT: tuple[Mutator, ...] = (
    flipped,
    cut,
    number_replaced,
    number_replaced,
    word_replaced,
    nested,
    line_moved,
)
JSON: tuple[Mutator, ...] = (*TEXT, tree_changed, tree_changed, tree_changed, tree_changed, key_doubled)
SMALL_TEXT: tuple[Mutator, ...] = (number_replaced, word_replaced, nested, flipped)
