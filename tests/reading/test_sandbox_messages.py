"""Messages of the child process: what is sent is what is received, and nothing else is accepted."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from weavecore.errors import BadIndex
from weavecore.model import Note, Origins, SurfaceMesh
from weavecore.reading.sandbox_messages import BEGIN, MOST_TEXT, Malformed, decode, receive, send, skip_to_messages
from weavecore.units import Length

KIND = b"R"
HEAD = struct.Struct("<cIQ")

PLAIN = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(st.characters())
VALUES = st.recursive(PLAIN, lambda some: st.lists(some, max_size=4) | st.lists(some, max_size=4).map(tuple))


def sent(value: Any) -> bytes:
    stream = BytesIO()
    send(stream, KIND, value)
    return stream.getvalue()


def received(content: bytes, *classes: type, most_data: int = 2**20) -> Any:
    return decode(receive(BytesIO(content), kinds=(KIND,), most_data=most_data), classes)


def message(text: str, data: bytes = b"") -> bytes:
    return HEAD.pack(KIND, len(text), len(data)) + text.encode("ascii") + data


@given(VALUES)
def test_plain_values_arrive_as_they_are(value: Any) -> None:
    arrived = received(sent(value))
    assert arrived == value
    assert repr(arrived) == repr(value), "a tuple is no list, and a bool no number"


@pytest.mark.parametrize(
    "array",
    [
        np.random.default_rng(1).normal(size=(7, 3)),
        np.arange(20)[::3],
        np.array([[True, False], [False, True]]),
        np.zeros((0, 3)),
        np.zeros((3, 0), np.int64),
        np.array(2.5),
        np.array([1.5, np.nan, np.inf, -0.0], ">f8"),
    ],
    ids=["floats", "strided", "bools", "empty", "without columns", "scalar", "other byte order"],
)
def test_arrays_arrive_to_the_last_bit(array: np.ndarray) -> None:
    arrived = received(sent(["before", array, (array,)]))[1]
    assert (arrived.shape, arrived.dtype.name) == (array.shape, array.dtype.name)
    assert arrived.tobytes() == array.astype(arrived.dtype).tobytes()


def test_a_surface_arrives_whole_and_checked() -> None:
    vertices, faces = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)]
    starts = Origins((np.array([0, 1, 2]),), np.array([False]))
    notes = (Note("SPLIT", "Split a vertex.", {"count": 1}, [(0, 1, 2)]),)
    surface = SurfaceMesh(vertices, faces, "Meters", 0.01, name="Shell", notes=notes, starts=starts)
    arrived = received(sent(surface), SurfaceMesh, Origins, Note)
    assert arrived.vertices.tobytes() == surface.vertices.tobytes()
    assert arrived.faces.tobytes() == surface.faces.tobytes()
    assert (arrived.unit, arrived.tolerance, arrived.name) == ("Meters", 0.01, "Shell")
    assert arrived.notes == surface.notes
    assert arrived.starts.paths[0].tolist() == [0, 1, 2]
    assert not arrived.vertices.flags.writeable
    wrong = sent(surface).replace(np.array([0, 2, 3]).tobytes(), np.array([0, 2, 9]).tobytes())
    with pytest.raises(BadIndex):
        received(wrong, SurfaceMesh, Origins, Note)


def test_a_class_that_is_not_accepted_is_not_made() -> None:
    assert received(sent(Length(2.0, "Meters")), Length) == Length(2.0, "Meters")
    with pytest.raises(Malformed):
        received(sent(Length(2.0, "Meters")))


@dataclass
class Other:
    value: Any


@pytest.mark.parametrize("value", [{}, {"a": 1}, object(), {1}, b"bytes", np.array(["text"]), Other(1j)])
def test_what_has_no_form_is_not_sent(value: Any) -> None:
    stream = BytesIO()
    with pytest.raises(TypeError, match="cannot be sent"):
        send(stream, KIND, [1, value])
    assert stream.getvalue() == b""


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nul",
        "[" * 100_000,
        "{}",
        '{"tuple": [1], "array": ["int64", [1]]}',
        '{"tuple": 5}',
        '{"array": ["object", [1]]}',
        '{"array": ["int64", [2]]}',
        '{"array": ["int64", [-1]]}',
        '{"array": ["int64", [true]]}',
        '{"array": ["int64", [4611686018427387904, 4]]}',
        '{"array": ["int64", 1]}',
        '{"array": 7}',
        '{"Length": {}}',
        '{"Length": {"value": 1, "other": 2}}',
        '{"Length": [1]}',
        '{"eval": {"source": "1"}}',
        json.dumps(["no array"]),
        "9" * 5000 + "x",
    ],
)
def test_a_text_that_is_not_of_the_format_is_malformed(text: str) -> None:
    with pytest.raises(Malformed):
        received(message(text, b"8 bytes!"), Length)


def test_a_bool_is_0_or_1_whatever_byte_was_sent() -> None:
    assert received(message('{"array": ["bool", [3]]}', b"\x00\x01\x07")).view(np.uint8).tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    "head", [HEAD.pack(b"?", 4, 0), HEAD.pack(KIND, MOST_TEXT + 1, 0), HEAD.pack(KIND, 4, 2**63), HEAD.pack(KIND, 4, 9)]
)
def test_a_length_is_checked_before_anything_is_read(head: bytes) -> None:
    stream = BytesIO(head + b"null" + bytes(100))
    with pytest.raises(Malformed):
        receive(stream, kinds=(KIND,), most_data=8)
    assert stream.tell() == HEAD.size


@given(st.integers(0, 200))
def test_a_message_that_breaks_off_is_the_end(length: int) -> None:
    whole = sent([np.arange(10), "text"])
    with pytest.raises(EOFError):
        receive(BytesIO(whole[: min(length, len(whole) - 1)]), kinds=(KIND,), most_data=2**20)


@pytest.mark.parametrize("noise", [b"", b"hello", b"hello\n\n", b"x" * 3_000_000])
def test_what_is_printed_before_the_messages_is_skipped(noise: bytes) -> None:
    stream = BytesIO(noise + BEGIN + sent(5))
    skip_to_messages(stream)
    assert decode(receive(stream, kinds=(KIND,), most_data=0)) == 5
    with pytest.raises(EOFError):
        skip_to_messages(BytesIO(noise))
