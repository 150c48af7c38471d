"""Damage to files: bytes, numbers and words of texts, trees of JSON, and what lies inside of archives.

Checksums and lengths would hide most of a reader from changed bytes. So archives are unpacked, one part is
damaged, and they are packed again, with lengths and checksums that fit.
"""

from __future__ import annotations

import gzip
import io
import random
import re
import struct
import zipfile
import zlib

import zstandard
from hostile_values import BOMB, INTEGERS
from plain_mutators import (
    BYTES,
    JSON,
    SMALL_TEXT,
    TEXT,
    Mutator,
    aliases_multiplied,
    cut,
    flipped,
    number_written,
    tag_written,
)


def mutate(kind: str, content: bytes, chance: random.Random) -> bytes:
    """A file of a kind of `KINDS` with one to three damages."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        try:
            content = chance.choice(KINDS[kind])(content, chance)
        except Exception:
            content = flipped(content, chance)  # damaged already, so that it cannot be taken apart
    return content


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
    """Content of a gzip, damaged; sometimes a bomb is added."""
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
