"""``weavecore view``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import pytest

Run = Callable[..., Any]


@pytest.fixture
def woven(run: Run, folder: Path) -> Path:
    assert run("weave", "tube.3dm", "--json", "woven.json", "--pattern", "plain", "-q").status == 0
    return folder / "woven.json"


def content_of(path: Path) -> Any:
    page = path.read_text("utf-8")
    return json.loads(page.split('id="data">', 1)[1].split("</script>", 1)[0])


def test_view_writes_a_page_of_a_result(run: Run, woven: Path) -> None:
    ended = run("view", "woven.json", "-o", "woven.html")
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.splitlines()[-1].split() == ["written", "woven.html"]
    strands = json.loads(woven.read_text("utf-8"))["strands"]
    content = content_of(Path("woven.html"))
    assert content["rods"]["names"] == [strand["id"] for strand in strands]
    assert content["sequence"] is not None


def test_the_page_is_the_one_that_weave_itself_writes(run: Run, woven: Path) -> None:
    assert run("weave", "tube.3dm", "-o", "direct.html", "--pattern", "plain", "-q").status == 0
    assert run("view", "woven.json", "-o", "woven.html", "-q").status == 0
    assert Path("direct.html").read_bytes() == Path("woven.html").read_bytes()


def test_view_takes_what_other_stages_have_written(run: Run, folder: Path) -> None:
    assert run("mesh", "tube.3dm", "-o", "mesh.json").status == 0
    assert run("view", "mesh.json", "-o", "mesh.html", "-q").status == 0
    content = content_of(Path("mesh.html"))
    assert (content["stage"], content["weave"], content["sequence"]) == ("Surface", None, None)


def test_a_page_is_replaced_only_when_that_is_asked_for(run: Run, woven: Path) -> None:
    Path("woven.html").write_text("mine", "utf-8")
    ended = run("view", "woven.json", "-o", "woven.html")
    assert (ended.status, ended.err.split()[1]) == (1, "EXISTS:")
    assert Path("woven.html").read_text("utf-8") == "mine"
    assert run("view", "woven.json", "-o", "woven.html", "--overwrite", "-q").status == 0
    assert Path("woven.html").stat().st_size > 100_000


@pytest.mark.parametrize("text", ["", "{}", '{"format":"weavecore","version":1', "[1]"])
def test_a_file_that_is_no_result_is_one_line(run: Run, folder: Path, text: str) -> None:
    Path("bad.json").write_text(text, "utf-8")
    ended = run("view", "bad.json", "-o", "bad.html")
    assert ended.status == 1
    assert ended.err.count("\n") == 1
    assert not Path("bad.html").exists()


@pytest.mark.parametrize("arguments", [("tube.3dm", "-o", "x.html"), ("woven.json", "-o", "x.png"), ("woven.json",)])
def test_other_endings_are_wrong_usage(run: Run, folder: Path, arguments: tuple[str, ...]) -> None:
    assert run("view", *arguments).status == 2
