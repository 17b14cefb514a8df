"""Ways to damage a whole file: each takes the bytes, a generator of numbers and other whole files of the format."""

from __future__ import annotations

import copy
import json
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

_CHUNK = struct.Struct("<Iq")
_CHECKED = 0x8000

Generator = np.random.Generator
Damage = Callable[[bytes, Generator, list[bytes]], bytes]


def _cut(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    return whole[: draw.integers(0, len(whole))]


def _flip(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    damaged = bytearray(whole)
    for at in draw.integers(0, len(whole), int(draw.integers(1, 20))):
        damaged[at] ^= 1 << int(draw.integers(0, 8))
    return bytes(damaged)


def _overwrite(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    at, length = int(draw.integers(0, len(whole))), int(draw.integers(1, 64))
    fill = [b"\xff" * length, b"\x00" * length, draw.bytes(length), b"9" * length, b"nan "][int(draw.integers(0, 5))]
    return whole[:at] + fill + whole[at + len(fill) :]


def _splice(whole: bytes, draw: Generator, others: list[bytes]) -> bytes:
    other = others[int(draw.integers(0, len(others)))]
    a, b = sorted(draw.integers(0, len(other), 2).tolist())
    at = int(draw.integers(0, len(whole)))
    return whole[:at] + other[a:b] + whole[at + int(draw.integers(0, 2)) * (b - a) :]


def _noise(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    return whole[: int(draw.integers(0, 80))] + draw.bytes(int(draw.integers(0, 4000)))


def _change_word(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    """One word of a text becomes another; in binary files an aligned number becomes an extreme one."""
    words = whole.split(b" ")
    if len(words) > 20:
        words[int(draw.integers(0, len(words)))] = [b"-1", b"1e309", b"99999999", b"", b"nan"][int(draw.integers(0, 5))]
        return b" ".join(words)
    at = 4 * int(draw.integers(0, max(len(whole) // 4 - 1, 1)))
    value = [2**31 - 1, -1, 2**24, 0][int(draw.integers(0, 4))]
    return whole[:at] + struct.pack("<i", value) + whole[at + 4 :]


def _change_in_chunk(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    """Change a `.3dm` inside a chunk and make its checksum right again."""
    chunks = list(_checked_chunks(whole))
    if not chunks:
        return _flip(whole, draw, [])
    damaged = bytearray(whole)
    for _again in range(int(draw.integers(1, 4))):
        start, end = chunks[int(draw.integers(0, len(chunks)))]
        at = int(draw.integers(start, max(end - 8, start + 1)))
        size = min(8, end - at)
        value = [draw.bytes(8), b"\xff" * 8, struct.pack("<d", float("nan")), struct.pack("<q", 2**40)][
            int(draw.integers(0, 4))
        ]
        damaged[at : at + size] = value[:size]
        damaged[end : end + 4] = struct.pack("<I", zlib.crc32(bytes(damaged[start:end])))
    return bytes(damaged)


def _checked_chunks(whole: bytes) -> Iterator[tuple[int, int]]:
    """Where chunks with a checksum that is right begin and end."""
    for at in range(32, len(whole) - _CHUNK.size):
        if not whole[at + 1] & (_CHECKED >> 8) or whole[at + 3] > 0x40:
            continue
        _, length = _CHUNK.unpack_from(whole, at)
        start, end = at + _CHUNK.size, at + _CHUNK.size + length - 4
        if 8 < length < len(whole) - start and struct.unpack_from("<I", whole, end)[0] == zlib.crc32(whole[start:end]):
            yield start, end


_ODD: tuple[Any, ...] = (
    *(None, True, "", [], {}, -1, 0, 1, 0.5, 2**31, 2**63, 10**400, 1e308, -1e308, 5e-324, 1e-9),
    *(
        "=1+1",
        "a b",
        "a\nb",
        "\u2028",
        "\ud800",
        "../x",
        "L1",
        "stacked",
        "twill 99/99",
        "x" * 5000,
        [[]],
        [0],
        {"": 0},
    ),
)


def change_value(whole: bytes, draw: Generator, _: list[bytes]) -> bytes:
    """A value of a JSON document becomes an odd one or another of its list, is left out, or stands there twice."""
    try:
        document = json.loads(whole)
    except (ValueError, RecursionError):
        document = None
    if not isinstance(document, (dict, list)):
        return _flip(whole or b" ", draw, [])
    for _again in range(int(draw.integers(1, 4))):
        holder = document
        while True:
            keys = sorted(holder) if isinstance(holder, dict) else range(len(holder))
            if not len(keys):
                break
            key = keys[int(draw.integers(0, len(keys)))]
            if isinstance(holder[key], (dict, list)) and holder[key] and draw.random() < 0.85:
                holder = holder[key]
                continue
            _change_at(holder, key, [holder[other] for other in keys], draw)
            break
    return json.dumps(document).encode()


def _change_at(holder: Any, key: Any, others: list[Any], draw: Generator) -> None:
    way = int(draw.integers(0, 6))
    if way == 0:
        del holder[key]
    elif way == 1:
        holder[key] = copy.deepcopy(others[int(draw.integers(0, len(others)))])
    elif way == 2 and isinstance(holder, list):
        holder.insert(key, copy.deepcopy(holder[key]))
    elif way == 3 and isinstance(holder[key], float):
        holder[key] *= [-1, 0, 2, 1e-3, 1e6, 1e-300][int(draw.integers(0, 6))]
    else:
        holder[key] = copy.deepcopy(_ODD[int(draw.integers(0, len(_ODD)))])


def damages_of(name: str) -> list[Damage]:
    """The damages that suit a format."""
    common: list[Damage] = [_cut, _flip, _overwrite, _splice, _noise, _change_word]
    if name == "3dm":
        return [*common, _change_in_chunk, _change_in_chunk, _change_in_chunk]
    return [_cut, _overwrite, *[change_value] * 8] if name in ("json", "fabricate") else common
