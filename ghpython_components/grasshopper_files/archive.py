"""Grasshopper's archives: a tree of chunks with typed items.

The binary form (``.gh``, ``.ghuser``) is raw deflate over ``chunk = name, index, number of items, number of
chunks, items…, chunks…``, all little-endian; `xml_archive` has the same tree as text (``.ghx``).
Items of a chunk are sorted by their names, without regard to case, as Grasshopper's own library leaves them.
"""

from __future__ import annotations

import struct
import uuid
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

NO_INDEX = -1

BOOL, INT32, INT64, SINGLE, DOUBLE, DATE, GUID, STRING = 1, 3, 4, 5, 6, 8, 9, 10
BYTES, POINT, POINT_F, SIZE, SIZE_F, RECTANGLE, RECTANGLE_F, COLOUR, BITMAP, VERSION = (
    20,
    30,
    31,
    32,
    33,
    34,
    35,
    36,
    37,
    80,
)

TYPE_NAMES = {
    BOOL: "gh_bool",
    INT32: "gh_int32",
    INT64: "gh_int64",
    SINGLE: "gh_single",
    DOUBLE: "gh_double",
    DATE: "gh_date",
    GUID: "gh_guid",
    STRING: "gh_string",
    BYTES: "gh_bytearray",
    POINT: "gh_drawing_point",
    POINT_F: "gh_drawing_pointf",
    SIZE: "gh_drawing_size",
    SIZE_F: "gh_drawing_sizef",
    RECTANGLE: "gh_drawing_rectangle",
    RECTANGLE_F: "gh_drawing_rectanglef",
    COLOUR: "gh_drawing_color",
    BITMAP: "gh_drawing_bitmap",
    VERSION: "gh_version",
}
"""What Grasshopper calls the types of items in XML."""

_FIXED = {
    BOOL: "<?",
    INT32: "<i",
    INT64: "<q",
    SINGLE: "<f",
    DOUBLE: "<d",
    DATE: "<q",
    POINT: "<2i",
    POINT_F: "<2f",
    SIZE: "<2i",
    SIZE_F: "<2f",
    RECTANGLE: "<4i",
    RECTANGLE_F: "<4f",
    COLOUR: "<4B",
    VERSION: "<3i",
}


@dataclass(frozen=True)
class Item:
    """A named value of one of the types above; colours are (alpha, red, green, blue)."""

    name: str
    type: int
    value: Any
    index: int = NO_INDEX


@dataclass
class Chunk:
    """A named list of items and of further chunks."""

    name: str
    index: int = NO_INDEX
    items: list[Item] = field(default_factory=list)
    chunks: list[Chunk] = field(default_factory=list)

    def put(self, type_: int, /, *, index: int = NO_INDEX, **values: Any) -> Chunk:
        """Add items of one type by their names, and give the chunk back."""
        self.items += [Item(name, type_, value, index) for name, value in values.items()]
        self.items.sort(key=lambda item: (item.name.lower(), item.index))
        return self

    def add(self, name: str, index: int = NO_INDEX) -> Chunk:
        """Add an empty chunk, and give it."""
        self.chunks.append(Chunk(name, index))
        return self.chunks[-1]

    def get(self, name: str, default: Any = None, *, index: int = NO_INDEX) -> Any:
        """The value of an item."""
        return next((item.value for item in self.items if (item.name, item.index) == (name, index)), default)

    def chunk(self, name: str, index: int = NO_INDEX) -> Chunk:
        """The chunk of that name.

        Raises
        ------
        KeyError
        """
        for chunk in self.chunks:
            if (chunk.name, chunk.index) == (name, index):
                return chunk
        raise KeyError(f"{name} {index}")

    def walk(self) -> Iterator[Chunk]:
        """Iterate over this chunk and all below it."""
        yield self
        for chunk in self.chunks:
            yield from chunk.walk()


def encode_archive(root: Chunk) -> bytes:
    """The bytes of a ``.gh`` or ``.ghuser`` file."""
    return deflate(_encode_chunk(root))


def decode_archive(content: bytes) -> Chunk:
    """The tree that a ``.gh`` or ``.ghuser`` file holds.

    Raises
    ------
    ValueError
        Where bytes are left over, or an item is of a type that is not known.
    """
    reader = _Reader(inflate(content))
    root = reader.chunk()
    if reader.position != len(reader.content):
        raise ValueError(f"{len(reader.content) - reader.position} bytes are left over after the root chunk")
    return root


def deflate(content: bytes) -> bytes:
    """Raw deflate, as .NET's DeflateStream."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(content) + packer.flush()


def inflate(content: bytes) -> bytes:
    """What `deflate` was given."""
    return zlib.decompress(content, -15)


def encode_text(text: str) -> bytes:
    """A text as .NET's BinaryWriter writes it: its length in bytes, seven bits at a time, and UTF-8."""
    content = text.encode("utf-8")
    length, prefix = len(content), bytearray()
    while length >= 0x80:
        prefix.append(length & 0x7F | 0x80)
        length >>= 7
    prefix.append(length)
    return bytes(prefix) + content


def _encode_chunk(chunk: Chunk) -> bytes:
    parts = [encode_text(chunk.name), struct.pack("<3i", chunk.index, len(chunk.items), len(chunk.chunks))]
    for item in chunk.items:
        parts += [encode_text(item.name), struct.pack("<2i", item.index, item.type), _encode_value(item)]
    return b"".join(parts + [_encode_chunk(child) for child in chunk.chunks])


def _encode_value(item: Item) -> bytes:
    value = item.value
    if item.type == STRING:
        return encode_text(value)
    if item.type == GUID:
        return uuid.UUID(str(value)).bytes_le
    if item.type in (BYTES, BITMAP):
        return struct.pack("<i", len(value)) + value
    if item.type == COLOUR:
        return struct.pack(_FIXED[COLOUR], *reversed(value))
    return struct.pack(_FIXED[item.type], *(value if isinstance(value, tuple) else (value,)))


class _Reader:
    """Reads a tree from bytes."""

    def __init__(self, content: bytes) -> None:
        self.content, self.position = content, 0

    def chunk(self) -> Chunk:
        name = self._text()
        index, n_items, n_chunks = self._numbers("<3i")
        items = [self._item() for _ in range(n_items)]
        return Chunk(name, index, items, [self.chunk() for _ in range(n_chunks)])

    def _item(self) -> Item:
        name = self._text()
        index, type_ = self._numbers("<2i")
        return Item(name, type_, self._value(type_), index)

    def _value(self, type_: int) -> Any:
        if type_ == STRING:
            return self._text()
        if type_ == GUID:
            return uuid.UUID(bytes_le=self._take(16))
        if type_ in (BYTES, BITMAP):
            return self._take(self._numbers("<i")[0])
        if type_ not in _FIXED:
            raise ValueError(f"An item of type {type_}, which is not known, at byte {self.position}")
        numbers = self._numbers(_FIXED[type_])
        if type_ == COLOUR:
            return numbers[::-1]
        return numbers if len(numbers) > 1 else numbers[0]

    def _text(self) -> str:
        length = shift = 0
        while True:
            (byte,) = self._take(1)
            length |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return self._take(length).decode("utf-8")

    def _numbers(self, form: str) -> tuple[Any, ...]:
        return struct.unpack(form, self._take(struct.calcsize(form)))

    def _take(self, n: int) -> bytes:
        if not 0 <= n <= len(self.content) - self.position:
            raise ValueError(f"{n} bytes are missing at byte {self.position}")
        self.position += n
        return self.content[self.position - n : self.position]
