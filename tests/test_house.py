"""The rules of the house that a program can check, and that README.md tells the truth."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "weavecore"
MODULES = sorted(PACKAGE.rglob("*.py"))
MOST_NAMES, MOST_LINES, MOST_LINES_OF_FUNCTION = 25, 700, 60


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def imports_of(tree: ast.AST) -> set[str]:
    """Full names of all that is imported, at the top or inside a function."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").exists() or path.is_dir()


def test_the_front_door_has_few_names_and_all_of_them_are_there() -> None:
    import weavecore

    assert 0 < len(weavecore.__all__) <= MOST_NAMES
    assert sorted(set(weavecore.__all__)) == sorted(weavecore.__all__)
    assert [name for name in weavecore.__all__ if not hasattr(weavecore, name)] == []


@pytest.mark.parametrize("path", [path for path in MODULES if path.name != "cli.py"], ids=name_of)
def test_nothing_inside_imports_the_front_door(path: Path) -> None:
    names = {name for name in imports_of(ast.parse(path.read_text("utf-8"))) if name.split(".")[0] == "weavecore"}
    # "from weavecore import x" is right only where x is a module, as "weavecore.x.y" is elsewhere.
    through_the_door = {name for name in names if name.count(".") < 2 and (name == "weavecore" or not is_module(name))}
    assert through_the_door == set()


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_files_and_functions_are_short(path: Path) -> None:
    text = path.read_text("utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    long = [
        node.name
        for node in ast.walk(ast.parse(text))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and lines_of(node) > MOST_LINES_OF_FUNCTION
    ]
    assert long == []


def lines_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of the body, without the docstring."""
    has_words = ast.get_docstring(function) is not None and len(function.body) > 1
    first = function.body[1] if has_words else function.body[0]
    return (function.end_lineno or first.lineno) - first.lineno + 1


def blocks_of(language: str) -> list[str]:
    """The code blocks of README.md in a language."""
    text = (ROOT / "README.md").read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_commands_of_the_readme_are_those_of_ci() -> None:
    ci = (ROOT / ".ci" / "run").read_text("utf-8")
    test_command = next(line for block in blocks_of("sh") for line in block.splitlines() if line.endswith("pytest"))
    assert test_command in ci.splitlines()


def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sample_files").symlink_to(ROOT / "sample_files")
    monkeypatch.chdir(tmp_path)
    (code,) = blocks_of("python")
    assert len(code.strip().splitlines()) <= 10
    exec(compile(code, "README.md", "exec"), {})
    written = re.findall(r'"(\w+\.(?:3dm|json|png))"', code.split("read_surface", 1)[1].split("\n", 1)[1])
    assert written
    assert all((tmp_path / name).stat().st_size > 1000 for name in written)


def test_the_files_that_the_documents_point_to_are_there() -> None:
    for document in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        links = re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text("utf-8"))
        assert [link for link in links if not (document.parent / link).exists()] == [], document.name
