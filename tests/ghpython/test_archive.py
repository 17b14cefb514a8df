from __future__ import annotations

import struct
import uuid
import zlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasshopper_files import archive
from grasshopper_files.archive import Chunk, Item, decode_archive, encode_archive, inflate
from grasshopper_files.internalised import decode_geometry, encode_geometry
from grasshopper_files.xml_archive import decode_xml, encode_xml

INT32 = st.integers(-(2**31), 2**31 - 1)
INT64 = st.integers(-(2**63), 2**63 - 1)
SINGLE, DOUBLE = st.floats(width=32, allow_nan=False, allow_infinity=False), st.floats(allow_nan=False)
# What XML cannot hold is no text of a canvas.
TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff"))
VALUES: dict[int, st.SearchStrategy[Any]] = {
    archive.BOOL: st.booleans(),
    archive.INT32: INT32,
    archive.INT64: INT64,
    archive.SINGLE: SINGLE,
    archive.DOUBLE: DOUBLE.filter(lambda x: abs(x) != float("inf")),
    archive.DATE: INT64,
    archive.GUID: st.uuids(),
    archive.STRING: TEXT | st.text("äß\n\t<&>\r", max_size=400),
    archive.BYTES: st.binary(max_size=300),
    archive.BITMAP: st.binary(max_size=300),
    archive.POINT: st.tuples(INT32, INT32),
    archive.POINT_F: st.tuples(SINGLE, SINGLE),
    archive.SIZE: st.tuples(INT32, INT32),
    archive.SIZE_F: st.tuples(SINGLE, SINGLE),
    archive.RECTANGLE: st.tuples(INT32, INT32, INT32, INT32),
    archive.RECTANGLE_F: st.tuples(SINGLE, SINGLE, SINGLE, SINGLE),
    archive.COLOUR: st.tuples(*[st.integers(0, 255)] * 4),
    archive.VERSION: st.tuples(INT32, INT32, INT32),
}


def test_every_type_has_a_name_and_is_tried() -> None:
    assert set(VALUES) == set(archive.TYPE_NAMES)


@st.composite
def items(draw: st.DrawFn) -> Item:
    type_ = draw(st.sampled_from(sorted(VALUES)))
    name = draw(st.text("abcXYZ_é", min_size=1, max_size=140))
    return Item(name, type_, draw(VALUES[type_]), draw(st.sampled_from([archive.NO_INDEX, 0, 11])))


TREES = st.recursive(
    st.builds(Chunk, st.just("Root"), st.integers(-1, 3), st.lists(items(), max_size=6)),
    lambda below: st.builds(
        Chunk, st.just("Root"), st.just(-1), st.lists(items(), max_size=3), st.lists(below, max_size=3)
    ),
    max_leaves=5,
)


@given(TREES)
def test_a_tree_comes_back_from_bytes(tree: Chunk) -> None:
    assert decode_archive(encode_archive(tree)) == tree


@given(TREES)
def test_a_tree_comes_back_from_xml(tree: Chunk) -> None:
    tree.index = archive.NO_INDEX
    assert decode_xml(encode_xml(tree)) == tree


def test_the_bytes_are_those_of_grasshoppers_format() -> None:
    tree = Chunk("Root").put(archive.INT32, Count=7)
    tree.add("Child", 2).put(archive.GUID, Id=uuid.UUID("00112233-4455-6677-8899-aabbccddeeff"))
    expected = b"\x04Root" + struct.pack("<3i", -1, 1, 1)
    expected += b"\x05Count" + struct.pack("<3i", -1, 3, 7)
    expected += b"\x05Child" + struct.pack("<3i", 2, 1, 0)
    expected += b"\x02Id" + struct.pack("<2i", -1, 9) + bytes.fromhex("33221100554477668899aabbccddeeff")
    assert inflate(encode_archive(tree)) == expected


def test_a_long_text_has_its_length_in_two_bytes() -> None:
    assert archive.encode_text("x" * 300) == b"\xac\x02" + b"x" * 300


def test_a_colour_is_blue_green_red_alpha_in_bytes_and_alpha_first_in_xml() -> None:
    tree = Chunk("Root").put(archive.COLOUR, C=(255, 1, 2, 3))
    assert inflate(encode_archive(tree)).endswith(bytes([3, 2, 1, 255]))
    assert b"<ARGB>255;1;2;3</ARGB>" in encode_xml(tree)


def test_items_are_sorted_by_name_without_regard_to_case() -> None:
    chunk = (
        Chunk("Root")
        .put(archive.STRING, b="", Ca="", A="")
        .put(archive.STRING, index=1, N="")
        .put(archive.STRING, index=0, N="")
    )
    assert [(item.name, item.index) for item in chunk.items] == [("A", -1), ("b", -1), ("Ca", -1), ("N", 0), ("N", 1)]


@pytest.mark.parametrize("cut", [1, 5, 20])
def test_a_file_that_is_cut_off_is_refused(cut: int) -> None:
    whole = inflate(encode_archive(Chunk("Root").put(archive.STRING, Text="some words")))
    with pytest.raises(ValueError, match="bytes are missing"):
        decode_archive(archive.deflate(whole[:-cut]))


def test_what_is_left_over_or_not_known_is_refused() -> None:
    whole = inflate(encode_archive(Chunk("Root").put(archive.INT32, Count=1)))
    with pytest.raises(ValueError, match="left over"):
        decode_archive(archive.deflate(whole + b"\x00"))
    with pytest.raises(ValueError, match="type 99"):
        decode_archive(archive.deflate(whole[:-8] + struct.pack("<2i", 99, 1)))
    with pytest.raises(zlib.error):
        decode_archive(b"no archive")


def test_geometry_comes_back_from_a_definition_and_nothing_else_does() -> None:
    rhino3dm = pytest.importorskip("rhino3dm")
    sphere = rhino3dm.Sphere(rhino3dm.Point3d(1, 2, 3), 4.0).ToBrep()
    content = encode_geometry(sphere)
    assert decode_geometry(content).Encode() == sphere.Encode()
    assert b"Rhino.Geometry.Brep" in inflate(content)
    with pytest.raises(ValueError, match="not that of one geometry"):
        decode_geometry(archive.deflate(inflate(content)[:-1]))
