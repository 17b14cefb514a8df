"""The page of error and note codes: what each means, and every remedy that the code gives with it.

Errors are the classes of `weavecore.errors`; their messages and remedies are those of the calls in the source, with
``…`` for what is put in at run time.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import weavecore
from weavecore import errors
from weavecore.model.notes import DOUBTS, NOTE_CODES

PACKAGE = Path(weavecore.__file__).parent
GAP = "…"

HEAD = """# Errors and notes

Made from the source: `weavecore/errors.py`, `weavecore/model/notes.py`, and every place that raises an error.
What is put in at run time is written as `…` here.

An error ends a command with status 1 and one line: code, what is wrong and where, remedy. In Python each is a
`WeaveError` with `code`, `what`, `ids` and `points`, and also the builtin exception named here.
"""


def text() -> str:
    """The page in Markdown."""
    found = _calls()
    parts = [HEAD, "| code | |", "|---|---|"]
    kinds = sorted(_kinds(), key=lambda kind: kind.code)
    parts += [f"| [`{kind.code}`](#{kind.code.lower()}) | {_first(kind)} |" for kind in kinds]
    parts += ["| [`WORKER_LOST`](#worker_lost) | A worker of an exploration ended, or its result was lost. |", ""]
    parts += ["## Errors", ""]
    for kind in kinds:
        parts += [
            f"### {kind.code}",
            "",
            f"In Python `{kind.__name__}`, which is also `{_builtin(kind)}`. {_first(kind)}",
            "",
        ]
        if found[kind.__name__]:
            parts += ["| what is wrong | remedy |", "|---|---|", *found[kind.__name__], ""]
    parts += [
        "### WORKER_LOST",
        "",
        "Only in the table of `weavecore explore`. Explore again with more memory a worker.",
        "",
    ]
    parts += ["## Notes", "", "What to do about a doubt is in [notes](../notes.md).", "", "| code | kind | says |"]
    parts += ["|---|---|---|"]
    parts += [f"| `{code}` | {'doubt' if code in DOUBTS else 'change'} | {says} |" for code, says in NOTE_CODES.items()]
    return "\n".join([*parts, ""])


def _kinds() -> list[type]:
    return [
        one
        for one in vars(errors).values()
        if isinstance(one, type) and issubclass(one, errors.WeaveError) and one is not errors.WeaveError
    ]


def _builtin(kind: type) -> str:
    return next(base.__name__ for base in kind.__mro__ if base.__module__ == "builtins")


def _first(kind: type) -> str:
    return " ".join((kind.__doc__ or "").split("\n\n")[0].split()).replace("``", "`")


def _calls() -> dict[str, list[str]]:
    """For each class of errors the rows of its table, each once, in the order of the source."""
    rows: dict[str, dict[str, None]] = defaultdict(dict)
    for path in sorted(PACKAGE.rglob("*.py")):
        for name, what, remedy in _errors_in(ast.parse(path.read_text("utf-8"))):
            rows[name][f"| {_cell(what)} | {_cell(remedy)} |"] = None
    return defaultdict(list, {name: list(found) for name, found in rows.items()})


def _errors_in(tree: ast.Module) -> Iterator[tuple[str, str, str]]:
    """Class, what is wrong and remedy of each call that makes an error."""
    known = _texts_of_names(tree)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    inner = {id(call): function for function in functions for call in ast.walk(function)}  # The innermost comes last.
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not node.args:
            continue
        remedies = [keyword.value for keyword in node.keywords if keyword.arg == "remedy"]
        if remedies:
            local = {**known, **(_texts_of_names(inner[id(node)]) if id(node) in inner else {})}
            what, remedy = _shown(node.args[0], local), _shown(remedies[0], local)
            if (what + remedy).strip(f" {GAP}"):
                yield getattr(node.func, "id", getattr(node.func, "attr", "")), what, remedy


def _texts_of_names(tree: ast.AST) -> dict[str, str]:
    """The texts that names are assigned in a module or a function; several for one name are alternatives."""
    found: dict[str, list[str]] = defaultdict(list)
    nodes = tree.body if isinstance(tree, ast.Module) else ast.walk(tree)
    for node in nodes:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            words = _shown(node.value, {})
            if words.strip(f" {GAP}") and not words.replace(".", "").isdigit():
                found[node.targets[0].id].append(words)
    return {name: " / ".join(dict.fromkeys(texts)) for name, texts in found.items()}


def _shown(node: ast.AST, known: dict[str, str]) -> str:
    """A text of the source, with … for what is put in."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else GAP
    if isinstance(node, ast.JoinedStr):
        return "".join(_shown(part, {}) for part in node.values)
    if isinstance(node, ast.BinOp):
        return _shown(node.left, known) + _shown(node.right, known)
    if isinstance(node, ast.IfExp):
        return f"{_shown(node.body, known)} / {_shown(node.orelse, known)}"
    if isinstance(node, ast.Name):
        return known.get(node.id, GAP)
    return GAP


def _cell(words: str) -> str:
    return " ".join(words.split()).replace("|", "\\|").replace("<", "&lt;").replace("[", "\\[")
