"""The pages of the reference that are made from the code have all of it, in plain words."""

from __future__ import annotations

import importlib
import re
import sys

import pytest

from document_blocks import ROOT
from weavecore import errors
from weavecore.cli import app
from weavecore.exporting.json_result import result_schema
from weavecore.model.notes import NOTE_CODES


@pytest.fixture
def text(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> str:
    """A page, by the name of the module that makes it."""
    monkeypatch.setattr(sys, "path", [str(ROOT / "docs" / "generate"), *sys.path])
    return importlib.import_module(request.param).text()


@pytest.mark.parametrize("text", ["commands_page"], indirect=True)
def test_every_option_of_every_command_is_in_the_reference(text: str) -> None:
    import typer.main

    group = typer.main.get_command(app)
    sections = dict(re.findall(r"^## weavecore (\w+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    assert set(sections) == set(group.commands)
    for name, command in group.commands.items():
        options = [word for one in command.params for word in one.opts if word.startswith("--")]
        assert [option for option in options if f"`{option}" not in sections[name]] == [], name


@pytest.mark.parametrize("text", ["codes_page"], indirect=True)
def test_every_code_is_in_the_reference_and_errors_have_their_remedies(text: str) -> None:
    sections = dict(re.findall(r"^### ([A-Z_]+)\n(.*?)(?=^### |^## |\Z)", text, re.MULTILINE | re.DOTALL))
    codes = {one.code for one in vars(errors).values() if isinstance(one, type) and hasattr(one, "code")}
    assert codes - {"WEAVE_ERROR", "UNIT_UNKNOWN"} <= set(sections)
    assert [code for code, section in sections.items() if "| remedy |" not in section] == ["WORKER_LOST"]
    assert [code for code in NOTE_CODES if f"| `{code}` |" not in text] == []


@pytest.mark.parametrize("text", ["json_result_page"], indirect=True)
def test_every_key_of_the_result_is_in_the_reference(text: str) -> None:
    schema = result_schema()
    assert [name for name in schema["properties"] if f"`{name}`" not in text and f"## {name}\n" not in text] == []
    assert "`bands.offsets`" in text


@pytest.mark.parametrize("text", ["notebook_page"], indirect=True)
def test_the_notebook_is_a_page_with_its_code(text: str) -> None:
    assert text.startswith("# ")
    assert text.count("```python\n") == 7
