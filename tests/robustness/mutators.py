"""Damage to files: bytes, numbers and words of texts, trees of JSON, and what lies inside of archives.

Checksums and lengths would hide most of a reader from changed bytes. So archives are unpacked, one part is
damaged, and they are packed again, with lengths and checksums that fit.
"""

from __future__ import annotations

import gzip
import io
import json
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

import zstandard

NUMBERS = (
    "1e999",
    "-1e999",
    "9" * 400,
    "-" + "9" * 5000,
    "NaN",
    "Infinity",
    "-Infinity",
    "0",
    "-1",
    "1e308",
    "5e-324",
    "1e39",
    "2147483648",
    "4294967295",
    "9223372036854775808",
    "0.5",
    "-0.0",
    "1e-400",
    "16777217",
    "1000000",
)
WORDS = (
    "\\ud800",
    "\\u0000",
    "\\udfff\\ud800",
    "\u202e\u0301" * 20,
    "x" * 10_000,
    "",
    "..",
    "../../etc/passwd",
    "/",
    "\U0001f9ff",
    "\\uFFFF",
    "%s%n",
    "~",
    "\u00e9\u0301",
    "a\\nb",
    "con",
    "\ufeff",
)
YAML = (
    "!!int ''",
    "!!float x",
    "!!binary '*'",
    "!!timestamp x",
    "!!python/object/apply:os.system [id]",
    "*a",
    "&a [*a]",
    "!!set {a, b}",
    "<<: 3",
    "? [a]",
    "|",
    ".inf",
    ".nan",
    "1:60:60",
    "0b2",
    "0x",
    "1_0",
    "2001-99-99",
    "!!omap [1]",
    "!!null x",
    "!!bool 2",
    "%TAG",
    "- -",
    "\t",
)
DEEP = (30, 100, 2_000, 100_000)
INTEGERS = (0, 1, 2, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 2**64 - 1)
FLOATS = (0.0, -1.0, float("nan"), float("inf"), 3.4e38, 1e-45, 1e300)

BOMB = 256 << 20
"""Bytes that a bomb unpacks to: more than any honest file here takes."""

Mutator = Callable[[bytes, random.Random], bytes]

_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*")


def mutate(kind: str, content: bytes, chance: random.Random) -> bytes:
    """A file of a kind of `KINDS` with one to three damages."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        try:
            content = chance.choice(KINDS[kind])(content, chance)
        except Exception:
            content = flipped(content, chance)  # damaged already, so that it cannot be taken apart
    return content


# ---- bytes ----


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


# ---- texts ----


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


# ---- trees of JSON ----


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


# ---- what is packed ----


def zip_member(content: bytes, chance: random.Random) -> bytes:
    """One file of a zip damaged, with a checksum that fits; or left out, named otherwise, or a bomb."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
        packing = archive.infolist()[0].compress_type
    name = chance.choice(list(members)[:2] if chance.random() < 0.5 else list(members))
    how = chance.random()
    if how < 0.8:
        kind = "json" if name.endswith(".json") else "npy" if name.endswith(".npy") else "bytes"
        members[name] = mutate(kind, members[name], chance)
    elif how < 0.86:
        del members[name]
    elif how < 0.92:
        members[chance.choice(("../" + name, "/" + name, name + "x", "data/1"))] = members.pop(name)
    elif how < 0.94:
        members[name] += bytes(BOMB)
        packing = zipfile.ZIP_DEFLATED
    else:
        other = chance.choice(list(members))
        members[name], members[other] = members[other], members[name]
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", packing) as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return out.getvalue()


_GZIP_BOMB = b""


def gzip_content(content: bytes, chance: random.Random) -> bytes:
    """What a gzip holds damaged; sometimes a bomb is added."""
    global _GZIP_BOMB
    plain = gzip.decompress(content)
    if chance.random() < 0.03:
        if not _GZIP_BOMB:
            _GZIP_BOMB = gzip.compress(bytes(BOMB), 9)
        return gzip.compress(mutate("bytes", plain, chance), 1) + _GZIP_BOMB
    return gzip.compress(mutate("bytes", plain, chance), 1)


_ZSTD_BOMB = b""


def spz_stream(content: bytes, chance: random.Random) -> bytes:
    """A stream of SPZ 4 damaged and packed again, or a bomb in its place; its size fits, or not."""
    global _ZSTD_BOMB
    streams, contents = content[15], struct.unpack_from("<I", content, 16)[0]
    table = [struct.unpack_from("<QQ", content, contents + 16 * n) for n in range(streams)]
    at, frames = contents + 16 * streams, []
    for packed, _ in table:
        frames.append(content[at : at + packed])
        at += packed
    n = chance.randrange(streams)
    sizes = [size for _, size in table]
    if chance.random() < 0.1:
        if not _ZSTD_BOMB:
            _ZSTD_BOMB = zstandard.compress(bytes(BOMB), 3)
        frames[n] = _ZSTD_BOMB
        if chance.random() < 0.5:
            sizes[n] = BOMB
    else:
        frames[n] = zstandard.compress(mutate("bytes", zstandard.decompress(frames[n], sizes[n]), chance), 1)
    if chance.random() < 0.3:
        sizes[n] = chance.choice(INTEGERS)
    heads = [struct.pack("<QQ", len(frame), size) for frame, size in zip(frames, sizes, strict=True)]
    return content[:contents] + b"".join(heads) + b"".join(frames)


def safetensors_header(content: bytes, chance: random.Random) -> bytes:
    """The JSON of a safetensors file damaged, its length fitting."""
    (length,) = struct.unpack_from("<Q", content)
    header = mutate("json", content[8 : 8 + length], chance)
    return struct.pack("<Q", len(header)) + header + content[8 + length :]


def safetensors_values(content: bytes, chance: random.Random) -> bytes:
    """The tensors damaged, the header as it is."""
    (length,) = struct.unpack_from("<Q", content)
    whole, values = content[: 8 + length], content[8 + length :]
    damaged = number_written(values, chance)
    return whole + (damaged if len(damaged) == len(values) else flipped(values, chance))


def glb_json(content: bytes, chance: random.Random) -> bytes:
    """The JSON of a .glb damaged, lengths fitting."""
    (length,) = struct.unpack_from("<I", content, 12)
    text = mutate("json", content[20 : 20 + length].rstrip(b" "), chance)
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    return (
        content[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + content[16:20] + text + rest
    )


def npy_header(content: bytes, chance: random.Random) -> bytes:
    """The header of an .npy damaged, its length fitting."""
    (length,) = struct.unpack_from("<H", content, 8)
    header = content[10 : 10 + length]
    odd = chance.choice(
        (b"'O'", b"'<f99'", b"'V8'", b"('<f8', (3,))", b"[('a', '<f8')]", b"'<M8[D]'", b"'<U3'")
    )
    if chance.random() < 0.3:
        header = re.sub(rb"'[<|>]\w+'", odd, header, count=1)
    else:
        header = mutate("small text", header, chance)
    return content[:8] + struct.pack("<H", len(header) & 0xFFFF) + header + content[10 + length :]


def png_chunk(content: bytes, chance: random.Random) -> bytes:
    """A chunk of a PNG damaged, its checksum fitting; of the header most often."""
    at, chunks = 8, []
    while at + 8 <= len(content):
        (length,) = struct.unpack_from(">I", content, at)
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + length]))
        at += 12 + length
    n = 0 if chance.random() < 0.5 else chance.randrange(len(chunks))
    kind, body = chunks[n]
    chunks[n] = (chance.choice((kind, kind, kind, b"zTXt", b"iCCP", b"PLTE")), mutate("bytes", body, chance))
    if chance.random() < 0.05:
        chunks.insert(1, (b"zTXt", b"a\0\0" + zlib.compress(bytes(BOMB), 9)))
    out = content[:8]
    for kind, body in chunks:
        out += struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return out


def ply_header(content: bytes, chance: random.Random) -> bytes:
    """The text of a PLY's header damaged."""
    head, mark, body = content.partition(b"end_header\n")
    return mutate("text", head, chance) + mark + body


KINDS: dict[str, tuple[Mutator, ...]] = {
    "bytes": BYTES,
    "text": TEXT,
    "small text": SMALL_TEXT,
    "json": JSON,
    "yaml": (*TEXT, tag_written, tag_written, aliases_multiplied),
    "zip": (*BYTES, *(zip_member,) * 8),
    "gzip": (*BYTES, *(gzip_content,) * 6),
    "spz4": (*BYTES, *(spz_stream,) * 8),
    "safetensors": (flipped, cut, *(safetensors_header,) * 6, *(safetensors_values,) * 3),
    "glb": (*BYTES, *(glb_json,) * 6),
    "npy": (*BYTES, *(npy_header,) * 4),
    "png": (*BYTES, *(png_chunk,) * 6),
    "ply": (*BYTES, *(ply_header,) * 4),
}
"""The damages to files of each kind."""
