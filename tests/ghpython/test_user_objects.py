from __future__ import annotations

import zlib
from itertools import combinations

import numpy as np
import pytest

import draw_icons
from ghpython.stubs import COMPONENTS, NAMES
from grasshopper_files.archive import decode_archive
from grasshopper_files.components import HINTS, encode_user_object, read_component, script_text


@pytest.mark.parametrize("name", NAMES)
def test_a_user_object_reads_back_as_its_folder_says(name: str) -> None:
    component = read_component(COMPONENTS / name)
    root = decode_archive(encode_user_object(component))
    assert root.get("Name") == component.name
    assert str(root.get("InstanceGuid")) == component.metadata["instanceGuid"]
    assert root.get("Icon") == component.icon
    inner = decode_archive(root.get("Object"))
    assert script_text(inner) == component.code
    assert inner.chunk("Script").chunk("LanguageSpec").get("Taxon") == "*.*.python"
    data = inner.chunk("ParameterData")
    for side, parameters in (("Input", component.inputs), ("Output", component.outputs)):
        assert data.get(f"{side}Count") == len(parameters)
        chunks = [data.chunk(f"{side}Param", i) for i in range(len(parameters))]
        assert [chunk.get("Name") for chunk in chunks] == [p["name"] for p in parameters]
        assert [chunk.get("Description") for chunk in chunks] == [p["description"] for p in parameters]
    hints = [str(data.chunk("InputParam", i).get("TypeHintID")) for i in range(len(component.inputs))]
    assert hints == [HINTS[p["typeHintID"]].id for p in component.inputs]


def test_no_two_ids_of_the_plugin_are_the_same() -> None:
    ids = []
    for name in NAMES:
        root = decode_archive(encode_user_object(read_component(COMPONENTS / name)))
        chunks = [root, *decode_archive(root.get("Object")).walk()]
        ids += [chunk.get("InstanceGuid") for chunk in chunks if chunk.get("InstanceGuid") is not None]
    assert len(ids) > 6 * len(NAMES)
    assert len(set(ids)) == len(ids)


@pytest.mark.parametrize("name", NAMES)
def test_an_icon_is_24_by_24_with_opacity(name: str) -> None:
    icon = (COMPONENTS / name / "icon.png").read_bytes()
    assert icon[12:16] == b"IHDR"
    assert icon[16:26] == (24).to_bytes(4, "big") * 2 + bytes([8, 6])


def test_items_that_grasshopper_looks_up_by_name_are_sorted() -> None:
    root = decode_archive(encode_user_object(read_component(COMPONENTS / NAMES[0])))
    for chunk in [*root.walk(), *decode_archive(root.get("Object")).walk()]:
        names = [(item.name.lower(), item.index) for item in chunk.items]
        assert names == sorted(names)


def test_an_icon_is_what_the_script_draws() -> None:
    for name in NAMES:
        drawn, kept = draw_icons.draw(name), (COMPONENTS / name / "icon.png").read_bytes()
        assert pixels(drawn) == pixels(kept), name


def test_icons_can_be_told_apart_at_their_size() -> None:
    images = {name: on_white(name) for name in NAMES}
    for one, other in combinations(NAMES, 2):
        assert np.abs(images[one] - images[other]).mean() > 45, f"{one} and {other} look alike"


def on_white(name: str) -> np.ndarray:
    icon = draw_icons.Icon()
    draw_icons.DRAWINGS[name](icon)
    values = icon.pixels().astype(float)
    alpha = values[..., 3:] / 255.0
    return values[..., :3] * alpha + 255.0 * (1.0 - alpha)


def pixels(png: bytes) -> bytes:
    length = int.from_bytes(png[33:37], "big")
    assert png[37:41] == b"IDAT"
    return zlib.decompress(png[41 : 41 + length])
