"""The rules of CONTRIBUTING.md that a program can check, and that documents name what is there, in plain words."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "weavecore"
MODULES = sorted(PACKAGE.rglob("*.py"))
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *sorted((ROOT / "docs").rglob("*.md"))]
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


EXACT = ("linking", "weaving", "model", "offsetting/distance")
"""Folders whose results depend on no rounding but that of IEEE 754."""


@pytest.mark.parametrize("folder", EXACT)
def test_no_elementary_function_of_numpy_decides_where_bytes_are_the_same_everywhere(folder: str) -> None:
    """NumPy's round the last bit in another way in other releases; those of `geometry/elementary.py` do not."""
    names = "sin|cos|tan|arcsin|arccos|arctan|arctan2|hypot|exp|expm1|log|log1p|log2|log10|power|cbrt|angle"
    calls = re.compile(rf"\bnp\.({names})\(")
    found = [
        f"{name_of(path)}:{number}"
        for path in sorted((PACKAGE / folder).glob("*.py"))
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if calls.search(line)
    ]
    assert not found


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
    test_command = next(
        line
        for block in blocks_of("sh")
        for line in block.splitlines()
        if " -m pytest" in line and "uv run" not in line
    )
    assert test_command in ci.splitlines()


def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sample_files").symlink_to(ROOT / "sample_files")
    monkeypatch.chdir(tmp_path)
    (code,) = blocks_of("python")  # Runs in `tests/docs/` as well; here its length and what it writes count.
    assert len(code.strip().splitlines()) <= 10
    exec(compile(code, "README.md", "exec"), {})
    written = re.findall(r'"(\w+\.(?:3dm|json|png))"', code.split("read_surface", 1)[1].split("\n", 1)[1])
    assert written
    assert all((tmp_path / name).stat().st_size > 1000 for name in written)


def test_the_citation_names_the_version_of_the_package() -> None:
    (package,) = re.findall(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE)
    (cited,) = re.findall(r"^version: (.+)", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    assert cited == package


def test_the_files_that_the_documents_point_to_are_there() -> None:
    hooks = (ROOT / "docs" / "generate" / "hooks.py").read_text("utf-8")
    made = {ROOT / "docs" / name for name in re.findall(r'^    "([\w/]+\.md)": ', hooks, re.MULTILINE)}
    assert made
    for document in DOCUMENTS:
        links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", document.read_text("utf-8"))
        places = [(document.parent / link).resolve() for link in links]
        assert [place for place in places if not place.exists() and place not in made] == [], document.name


FOLDERS = ("weavecore", "tests", "benchmarks", "docs", "ghpython_components", "sample_files", ".ci")


@pytest.fixture(scope="module")
def tree() -> set[str]:
    """The files and folders of the checkout, and the ends of their paths: a document may name ``rays.py`` alone."""
    paths = [ROOT / name for name in FOLDERS]
    paths += [path for folder in paths for path in folder.rglob("*") if "__pycache__" not in path.parts]
    parts = [path.relative_to(ROOT).parts for path in paths]
    return {"/".join(part[first:]) for part in parts for first in range(len(part))}


def paths_named_in(text: str) -> set[str]:
    """Scripts and folders named between backticks or in a command."""
    quoted = " ".join(re.findall(r"```.*?```|`[^`\n]+`", text, re.DOTALL)).replace("`", " ")
    words = {word.rstrip(".,;:)").lstrip("(") for word in quoted.split()}
    named = {word for word in words if re.fullmatch(r"[\w./-]*(?:\w\.(?:py|sh)|\w/)", word)}
    return {re.sub(r"^(?:\.\./)+", "", word).rstrip("/") for word in named}


def test_paths_are_found_in_a_document() -> None:
    text = "Run `python a/b.py`, see `linking/`, `../geometry/refine.py` and `c.py`: `f`. Not x.py, `.3dm` or `1/2`."
    assert paths_named_in(text) == {"a/b.py", "linking", "geometry/refine.py", "c.py"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_the_scripts_and_folders_that_the_documents_name_are_there(document: Path, tree: set[str]) -> None:
    text = document.read_text("utf-8")
    assert sorted(paths_named_in(text) - tree) == []


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    site = (ROOT / "mkdocs.yml").read_text("utf-8")
    pages = [page.relative_to(ROOT / "docs").as_posix() for page in DOCUMENTS[3:]]
    assert [page for page in pages if not re.search(rf": {re.escape(page)}$", site, re.MULTILINE)] == []


NOT_PLAIN = [
    r"\bis no (?!(?:more|less|longer|further)\b)\w+",
    r"\btells? (?:it|of|that|what|how|whether|which|the)\b",
    r"\btold\b",
    r"\bbears?\b",
    r"\bin the middle\b(?! of\b)",
    r"\bit breaks\b",
    r"\bleave \S+ (?:\S+ )?away\b",
    r"\bdo(?:es)? not hold\b",
    r"\bsettl(?:e|es|ed|ing)\b",
    r"\bselvedges?\b",
    r"\bhems?\b",
    r"\bseats?\b",
    r"\b(?:ladder|rung)s?\b",
    r"\bwhat is given\b",
    r"\bsay nothing\b",
    r"\blook at\b",
    r"\bmade anew\b",
    r"\bmend(?:s|ed|ing)?\b",
    r"\buprighting\b|\bloosening\b|\bfairing\b",
]
"""Phrasings with a usual word in their place: not a, list, median, exceeds, omit, free border, check, repair …"""


def plain_faults(text: str) -> list[str]:
    return [found[0] for pattern in NOT_PLAIN for found in re.finditer(pattern, text, re.IGNORECASE)]


def texts_of_errors(tree: ast.AST) -> list[str]:
    """The texts in raise statements, and in whatever else makes an error: calls with a remedy."""
    makers = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise)
        or (isinstance(node, ast.Call) and any(keyword.arg == "remedy" for keyword in node.keywords))
    ]
    return [
        text_of(node) for maker in makers for node in ast.walk(maker) if isinstance(node, (ast.JoinedStr, ast.Constant))
    ]


def text_of(node: ast.JoinedStr | ast.Constant) -> str:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    return "".join(str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values)


def test_faults_of_language_are_found_in_errors() -> None:
    code = "raise Bad(f'{name} is no folder', remedy='Leave the unit away.')\nx = Bad('A', remedy='Look at it')"
    assert {fault for text in texts_of_errors(ast.parse(code)) for fault in plain_faults(text)} == {
        "is no folder",
        "Leave the unit away",
        "Look at",
    }


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_errors_keep_to_plain_english(path: Path) -> None:
    texts = texts_of_errors(ast.parse(path.read_text("utf-8")))
    assert [fault for text in texts for fault in plain_faults(text)] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_documents_keep_to_plain_english(document: Path) -> None:
    assert plain_faults(re.sub(r"\s+", " ", document.read_text("utf-8"))) == []


def test_help_keeps_to_plain_english() -> None:
    from typer.testing import CliRunner

    from weavecore.cli import app

    for command in ["", *(one.callback.__name__ for one in app.registered_commands if one.callback)]:
        shown = CliRunner().invoke(app, [*command.split(), "--help"], env={"COLUMNS": "600", "TERM": "dumb"})
        assert shown.exit_code == 0
        assert plain_faults(re.sub(r"\s+", " ", shown.output)) == [], command


def test_tooltips_of_components_keep_to_plain_english() -> None:
    files = sorted((ROOT / "ghpython_components").glob("*/metadata.json"))
    assert files
    for file in files:
        assert plain_faults(json.dumps(json.loads(file.read_text("utf-8")), ensure_ascii=False)) == [], file.parent.name
