"""The page as a file: what stands in it, and what it holds of a result."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib import resources
from typing import Any, Optional

import numpy as np
import pytest

from weavecore.model import Weave
from weavecore.viewing.page.html_page import encode_page
from weavecore.viewing.page.page_content import page_content
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_sample, woven_tube
from woven_tube import tube_latitudes, tube_lattice, tube_strands, tube_surface


class Elements(HTMLParser):
    """Start tags, and the text of scripts and styles."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, Optional[str]]]] = []
        self.texts: list[str] = []
        self.is_inside = False
        self.feed(page.decode())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, Optional[str]]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.texts.append("")
        self.is_inside = True

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002
        self.is_inside = False

    def handle_data(self, data: str) -> None:
        if self.is_inside:
            self.texts[-1] += data

    def texts_of(self, tag: str) -> list[str]:
        return [text for (name, _), text in zip(self.tags, self.texts) if name == tag]


def unpacked(packed: dict[str, str]) -> np.ndarray:
    kinds = {"Float32Array": "<f4", "Uint32Array": "<u4", "Uint8Array": "u1"}
    return np.frombuffer(base64.b64decode(packed["data"]), kinds[packed["type"]])


def page_of(weave: Weave) -> bytes:
    return encode_page(weave, sequence=find_sequence(weave))


def test_the_same_value_gives_the_same_bytes() -> None:
    weave = woven_tube("plain")
    assert page_of(weave) == page_of(replace(weave))


def test_every_mark_of_the_template_is_filled() -> None:
    page = page_of(woven_tube("plain")).decode()
    template = resources.files("weavecore.viewing.page").joinpath("assets", "page.html").read_text("utf-8")
    marks = re.findall(r"\{\{\w+\}\}", template)
    assert len(marks) == 7
    assert [mark for mark in marks if mark in page] == []


def test_its_policy_forbids_all_but_what_stands_in_it() -> None:
    elements = Elements(page_of(woven_tube("plain")))
    (policy,) = (attrs["content"] for tag, attrs in elements.tags if attrs.get("http-equiv"))
    rules = dict(rule.strip().split(" ", 1) for rule in str(policy).split(";"))
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    data, *programs = elements.texts_of("script")
    assert len(programs) == 2
    for rule, texts in (("script-src", programs), ("style-src", elements.texts_of("style"))):
        hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts]
        assert rules[rule].split() == [f"'sha256-{digest}'" for digest in hashes]
    assert json.loads(data)["stage"] == "Plain pattern, plain"


def test_nothing_in_it_points_elsewhere() -> None:
    elements = Elements(page_of(woven_tube("plain")))
    assert [attrs for _, attrs in elements.tags if {"src", "href", "srcset", "action"} & set(attrs)] == []
    assert not re.search(r"url\(|@import", elements.texts_of("style")[0])
    assert [
        attrs for _, attrs in elements.tags if any(name.startswith("on") or name == "style" for name in attrs)
    ] == []


@pytest.mark.parametrize("ending", ["</script>", "</script x", "<!--<script "])
def test_no_name_ends_the_element_that_it_stands_in(ending: str) -> None:
    name = f"{ending}</title><script>alert(1)</script>{{{{program}}}}\u2028\ud800&amp;"
    page = encode_page(replace(tube_surface(), name=name))
    elements = Elements(page)
    assert len(elements.texts_of("script")) == 3
    assert not set("<>&") & set(elements.texts_of("script")[0])
    assert json.loads(elements.texts_of("script")[0])["title"] == name
    assert elements.texts_of("title")[0].startswith(f"{ending}</title><script>alert(1)")


def test_the_licence_of_what_is_bundled_goes_with_it() -> None:
    page = page_of(woven_tube("plain")).decode()
    assert re.search(
        r"three\.js, which draws.*The MIT License.*three\.js authors.*Permission is hereby granted", page, re.DOTALL
    )


def test_the_bundle_is_of_the_version_that_its_script_names() -> None:
    assets = resources.files("weavecore.viewing.page").joinpath("assets")
    version = re.search(r"^three=0\.(\d+)\.", assets.joinpath("make_three.sh").read_text("utf-8"), re.MULTILINE)
    assert version
    assert f'revision:"{version[1]}"' in assets.joinpath("three.js").read_text("utf-8")


@pytest.mark.parametrize(("name", "pattern"), [("six_way_joint", "triangular"), ("hemisphere", "kagome")])
def test_the_rods_keep_their_shape(name: str, pattern: str) -> None:
    weave = woven_sample(name, pattern)
    rods = page_content(weave)["rods"]
    offsets = unpacked(rods["offsets"]).astype(int)
    points = unpacked(rods["points"]).reshape(-1, 3).astype(float)
    assert tuple(rods["names"]) == weave.ids
    assert unpacked(rods["length"]) == pytest.approx(weave.axes.lengths, rel=1e-6)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    drawn = np.array([steps[a : b - 1].sum() for a, b in zip(offsets, offsets[1:])])
    assert drawn == pytest.approx(weave.axes.lengths, rel=2e-3)
    assert len(points) < 8 * weave.lattice.n_edges


def test_the_depth_along_a_rod_is_the_generation_of_its_nodes() -> None:
    weave = woven_tube("triangular")
    latitudes, strands = weave.lattice.latitudes, weave.strands
    rods = page_content(weave)["rods"]
    depth, offsets = unpacked(rods["depth"]), unpacked(rods["offsets"]).astype(int)
    stations = unpacked(rods["stations"])
    for s in range(len(weave)):
        mine = slice(offsets[s], offsets[s + 1])
        visits = slice(strands.offsets[s], strands.offsets[s + 1])
        expected = latitudes.generation[weave.lattice.node_latitude[strands.nodes[visits]]]
        at = np.interp(weave.axes.stations[visits], stations[mine], depth[mine])
        assert at == pytest.approx(expected, abs=1e-3)
        if strands.closed[s]:
            assert depth[mine][-1] == depth[mine][0]


def test_the_joints_keep_their_order_and_the_steps_theirs() -> None:
    weave = woven_tube("twill")
    sequence = find_sequence(weave)
    content = page_content(weave, sequence=sequence)
    assert unpacked(content["weave"]["jointRods"]).tolist() == weave.joints.strand.tolist()
    assert unpacked(content["weave"]["jointOffsets"]).tolist() == weave.joints.offsets.tolist()
    stations = weave.axes.stations[weave.joints.visit]
    assert unpacked(content["weave"]["jointStations"]) == pytest.approx(stations, rel=1e-6)
    assert unpacked(content["sequence"]["rods"]).tolist() == sequence.strand.tolist()
    assert unpacked(content["sequence"]["tied"]).tolist() == sequence.tied.tolist()


def test_a_surface_far_from_the_origin_loses_nothing() -> None:
    near, far = tube_surface(), replace(tube_surface(), vertices=tube_surface().vertices + 1e6)
    shapes = [unpacked(page_content(one)["surface"]["vertices"]) for one in (near, far)]
    assert shapes[0] == pytest.approx(shapes[1], abs=1e-6)


def figures_of(content: dict[str, Any]) -> dict[str, str]:
    return {row["label"]: row["text"] for row in content["figures"]}


def test_each_stage_tells_its_own_figures() -> None:
    surface = page_content(tube_surface())
    assert figures_of(surface)["Faces"] == "48"
    assert surface["rods"]["names"] == ["border 0", "border 1"]
    latitudes = page_content(tube_latitudes())
    assert figures_of(latitudes)["Generations"] == "3"
    assert len(latitudes["rods"]["names"]) == 6
    lattice = page_content(tube_lattice(), strands=tube_strands())
    assert figures_of(lattice)["Edges"] == str(tube_lattice().n_edges)
    assert [family["name"] for family in lattice["families"]] == ["Latitudes", "Longitudes", "Pockets"]
    weave = woven_tube("plain")
    woven = page_content(weave)
    assert figures_of(woven)["Rods"] == str(len(weave))
    (longest,) = (row for row in woven["figures"] if row["label"] == "Longest")
    assert weave.axes.lengths[longest["rod"]] == weave.axes.lengths.max()
    assert latitudes["weave"] is lattice["weave"] is surface["weave"] is None


def test_several_spacings_are_told_from_the_least_to_the_greatest() -> None:
    of_tube = tube_latitudes()
    latitudes = replace(of_tube, distance=of_tube.distance + 0.5 * (of_tube.generation == 1))
    least, greatest = latitudes.steps.min(), latitudes.steps.max()
    assert least < greatest
    assert figures_of(page_content(latitudes))["Spacing"] == f"{least:g} m to {greatest:g} m"


def test_straight_rods_have_a_radius_that_javascript_reads() -> None:
    weave = woven_tube("plain")
    radius = np.array(weave.bending.min_radius)
    radius[-1] = np.inf
    content = page_content(replace(weave, bending=replace(weave.bending, min_radius=radius)))
    assert unpacked(content["weave"]["minRadius"])[-1] > 3.4e38
    json.dumps(content, allow_nan=False)
