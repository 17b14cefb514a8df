"""The page of all commands and their options, from the command line program itself."""

from __future__ import annotations

from typing import Any

import typer.main

from weavecore.cli import app

HEAD = """# Commands

Made from `weavecore --help`. Lengths are in the unit of the input, or in the one that is written after them: `120`,
`120mm`, `4.7in`. The exit status is 0 when all went well, 1 when an input was refused (one line with a
[code](codes.md)), and 2 when the command was typed wrongly.
"""


def text() -> str:
    """The page in Markdown."""
    group = typer.main.get_command(app)
    return "\n".join([HEAD, *(_section(name, command) for name, command in group.commands.items())])  # type: ignore[attr-defined]


def _section(name: str, command: Any) -> str:
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    options = [one for one in command.params if one.param_type_name == "option"]
    usage = " ".join(["weavecore", name, *(_metavar(one) for one in arguments)])
    rows = [f"| `{_metavar(one)}` | {_cell(one.help)} | |" for one in arguments]
    rows += [f"| {_names(one)} | {_cell(one.help)} | {_default(one)} |" for one in options]
    return "\n".join(
        [
            *(f"## weavecore {name}", "", f"`{usage} [OPTIONS]`", "", _prose(command.help), ""),
            *("| | | default |", "|---|---|---|", *rows, ""),
        ]
    )


def _metavar(one: Any) -> str:
    return str(one.metavar or one.name.upper())


def _names(one: Any) -> str:
    value = "" if one.is_flag else f" {_metavar(one)}"
    named = [*one.opts, *one.secondary_opts]
    return ", ".join(f"`{name}{value}`" for name in sorted(named, key=len, reverse=True))


def _default(one: Any) -> str:
    if one.required:
        return "required"
    if one.is_flag or one.default in (None, 0.0) or callable(one.default):
        return ""
    return f"`{one.default}`"


def _prose(words: str | None) -> str:
    return "\n\n".join(" ".join(part.split()) for part in (words or "").split("\n\n"))


def _cell(words: str | None) -> str:
    return " ".join((words or "").split()).replace("|", "\\|")
