"""Messages between the process that reads a file and its parent: JSON and raw arrays, nothing that can run.

A message is one frame of bytes, little-endian:

    kind | length of the text | length of the data | text | data
    1 byte      4 bytes              8 bytes          JSON   arrays, end to end

The text describes a value.  What JSON has no form for is an object with a single key:

    {"tuple": [...]}    {"array": ["float64", [n, 3]]}    {"SurfaceMesh": {"vertices": ..., "faces": ...}}

Arrays lie in the data in the order in which the text names them.  The receiver lists the dataclasses that it accepts,
and their own constructors check the values; both lengths are checked before anything is read, and memory is taken
only for bytes that have arrived.  Linear in the size of the value.
"""

from __future__ import annotations

import dataclasses
import json
import math
import struct
from collections.abc import Iterable, Mapping
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import WeaveError

BEGIN = b"\nweavecore messages begin\n"
"""The line that comes before the first message; what the interpreter or a library prints before it is skipped."""

MOST_TEXT = 64 * 2**20
"""Most bytes of text in a message: the report of a file of 100,000 objects takes 35 MB."""

_HEAD = struct.Struct("<cIQ")
_PIECE = 2**20  # So many bytes are asked for at once.
_DTYPES = {dtype.name: dtype for dtype in map(np.dtype, (np.bool_, np.int64, np.float64))}
_TUPLE, _ARRAY = "tuple", "array"


class Malformed(ValueError):
    """Bytes that are not a message, or a value of a kind that is not accepted."""


class Message(NamedTuple):
    """A message as it was received: its kind, and a value that is still to be decoded."""

    kind: bytes
    text: bytearray
    data: bytearray


def send(stream: IO[bytes], kind: bytes, value: Any) -> None:
    """Write a message.

    Parameters
    ----------
    stream : binary file
    kind : bytes
        One byte.
    value : object
        None, numbers, texts, lists, tuples, dataclasses, and arrays of bool, int64 or float64.

    Raises
    ------
    TypeError
        Where the value holds anything else; nothing is written then.
    """
    arrays: list[NDArray[Any]] = []
    text = json.dumps(_plain(value, arrays)).encode("ascii")
    stream.write(_HEAD.pack(kind, len(text), sum(array.nbytes for array in arrays)))
    stream.write(text)
    for array in arrays:
        stream.write(array.data if array.size else b"")
    stream.flush()


def _plain(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """The value as JSON has it; the arrays in it are appended to a list."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, list):
        return [_plain(item, arrays) for item in value]
    if isinstance(value, tuple):
        return {_TUPLE: [_plain(item, arrays) for item in value]}
    if isinstance(value, np.ndarray) and value.dtype.name in _DTYPES:
        arrays.append(np.ascontiguousarray(value, _DTYPES[value.dtype.name]))
        return {_ARRAY: [value.dtype.name, list(value.shape)]}
    if dataclasses.is_dataclass(value):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        return {type(value).__name__: {name: _plain(field, arrays) for name, field in fields.items()}}
    raise TypeError(f"a {type(value).__name__} cannot be sent")


def skip_to_messages(stream: IO[bytes]) -> None:
    """Read to the end of `BEGIN`.

    Raises
    ------
    EOFError
        Where it does not come.
    """
    line = None
    while line != BEGIN[1:]:
        line = stream.readline(_PIECE)
        if not line:
            raise EOFError


def receive(stream: IO[bytes], *, kinds: Iterable[bytes], most_data: int) -> Message:
    """Read a message.

    Parameters
    ----------
    stream : binary file
    kinds : iterable of bytes
        Those that are known.
    most_data : int
        Most bytes of arrays.

    Raises
    ------
    EOFError
        Where the stream ends.
    Malformed
        Where the kind is not known, or a length is beyond its limit.
    """
    kind, n_text, n_data = _HEAD.unpack(_read(stream, _HEAD.size))
    if kind not in kinds or n_text > MOST_TEXT or n_data > most_data:
        raise Malformed(f"a message of kind {kind!r} with {n_text} and {n_data} bytes")
    return Message(kind, _read(stream, n_text), _read(stream, n_data))


def _read(stream: IO[bytes], length: int) -> bytearray:
    read = bytearray()
    while len(read) < length:
        piece = stream.read(min(length - len(read), _PIECE))
        if not piece:
            raise EOFError
        read += piece
    return read


def decode(message: Message, classes: Iterable[type] = ()) -> Any:
    """The value of a message.

    Parameters
    ----------
    message : Message
    classes : iterable of type
        Dataclasses that the value may be made of.

    Raises
    ------
    Malformed
        Where it is not made of these, plain values and arrays.
    WeaveError
        Where a dataclass refuses its values.
    """
    values = _Values(message.data, {one.__name__: one for one in classes})
    try:
        value = values.build(json.loads(message.text))
    except WeaveError:
        raise
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise Malformed(str(error)) from error
    if values.position != len(message.data):
        raise Malformed("bytes that belong to no array")
    return value


class _Values:
    """Builds values from their text; arrays are taken from the data one after the other."""

    def __init__(self, data: bytearray, classes: Mapping[str, type]) -> None:
        self._data, self._classes = data, classes
        self.position = 0

    def build(self, plain: Any) -> Any:
        if isinstance(plain, list):
            return [self.build(item) for item in plain]
        if not isinstance(plain, dict):
            return plain
        ((name, content),) = plain.items()
        if name == _TUPLE:
            return tuple(self.build(item) for item in content)
        if name == _ARRAY:
            return self._array(*content)
        return self._classes[name](**{field: self.build(value) for field, value in content.items()})

    def _array(self, dtype_name: str, shape: list[int]) -> NDArray[Any]:
        dtype = _DTYPES[dtype_name]
        if not all(type(n) is int and n >= 0 for n in shape):
            raise Malformed(f"an array of shape {shape}")
        start, self.position = self.position, self.position + math.prod(shape) * dtype.itemsize
        if self.position > len(self._data):
            raise Malformed("arrays beyond the end of the data")
        # NumPy relies on a bool being 0 or 1, and any byte may have been sent.
        sent = np.frombuffer(memoryview(self._data)[start : self.position], np.uint8 if dtype == np.bool_ else dtype)
        return sent.astype(dtype).reshape(shape)
