"""The command as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "weavecore"]


def ended(command: list[str], **more: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, with more variables in its environment."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **more}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_a_whole_run_leaves_the_error_stream_empty(folder: Path) -> None:
    done = ended([*COMMAND, "weave", "tube.3dm", "--json", "w.json", "--spacing", "1"], FORCE_COLOR="1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "spacing" in done.stdout
    assert Path("w.json").exists()


def test_a_refusal_is_one_line_and_1(folder: Path) -> None:
    done = ended([*COMMAND, "weave", "none.3dm"])
    assert done.returncode == 1
    assert done.stderr.startswith("weavecore: UNREADABLE: none.3dm")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("command", [COMMAND, [sys.executable, "-c", "from weavecore.cli import main; main()"]])
def test_modules_beside_the_input_are_not_run(folder: Path, command: list[str]) -> None:
    if command[1] == "-c":  # As the script that pip installs: it has its own folder on the path, not the current one.
        command = [*command[:2], f"import sys; del sys.path[0]; {command[2]}"]
    names = ("queue", "numpy", "json", "struct", "pickle", "scipy", "rhino3dm", "sitecustomize", "usercustomize")
    for name in names:
        Path(f"{name}.py").write_text(f"print('{name} runs'); open('run_{name}', 'w').close()")
    done = ended([*command, "info", "tube.3dm"])
    assert (done.returncode, done.stderr) == (0, "")
    assert "can be woven" in done.stdout
    assert list(folder.glob("run_*")) == []


def test_help_and_errors_of_usage_load_nothing_heavy(folder: Path) -> None:
    code = "import sys; from weavecore.cli import main\ntry: main(sys.argv[1:])\nfinally: print(sorted(sys.modules))"
    for arguments in (["--help"], ["--version"], ["weave", "--help"], ["weave", "x.3dm", "--spacing", "wide"]):
        done = ended([sys.executable, "-c", code, *arguments])
        assert "'typer'" in done.stdout
        for heavy in ("numpy", "scipy", "rhino3dm", "trimesh"):
            assert f"'{heavy}'" not in done.stdout, arguments


@pytest.mark.skipif(os.name == "nt", reason="needs resource limits")
def test_a_disk_that_is_full_leaves_the_old_results_whole(folder: Path) -> None:
    """Limits on the size of a file stand for the full disk."""
    code = (
        "import resource, sys; from weavecore.cli import main\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)); main(sys.argv[1:])"
    )
    for name in ("w.json", "w.3dm"):
        Path(name).write_text("old")
    before = sorted(path.name for path in folder.iterdir())
    done = ended(
        [sys.executable, "-c", code, "weave", "tube.3dm", "-o", "w.3dm", "--json", "w.json", "--overwrite"],
        PYTHONDONTWRITEBYTECODE="1",
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith("weavecore: NOT_WRITTEN: w.")
    assert done.stderr.count("\n") == 1
    assert [Path(name).read_text() for name in ("w.json", "w.3dm")] == ["old", "old"]
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.skipif(os.name == "nt", reason="POSIX pipes")
def test_a_reader_that_goes_away_is_not_told_of(folder: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    command, environment = [*COMMAND, "info", "tube.3dm"], {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert done.stderr == ""


def test_a_terminal_without_greek_letters_gets_the_table_all_the_same(folder: Path) -> None:
    done = ended([*COMMAND, "info", "tube.3dm"], PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    assert "can be woven" in done.stdout


@pytest.mark.skipif(os.name == "nt", reason="needs a pseudo-terminal")
def test_a_bar_is_drawn_on_a_terminal(folder: Path) -> None:
    import pty

    screen, terminal = pty.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    command = [*COMMAND, "mesh", "tube.3dm", "-o", "m.off"]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=terminal, text=True, check=True)
    os.close(terminal)
    assert "\x1b[" not in done.stdout
    assert b"\x1b[" in os.read(screen, 4096)
    os.close(screen)
