"""Runs commands with a fault at each call of the file system in turn; `test_faults` starts it as a process of its own.

An audit hook (PEP 578) sees opening, renaming, linking, removing and making folders before they are done; writing,
syncing and the exchange of two folders, which have no audit events, are wrapped.  What is computed is kept from
the first run, so that later ones only write.

    python fault_injection.py COMMAND FOLDER

writes a line for each call at which something was found wrong, and at the end how many faults there were.
"""

from __future__ import annotations

import contextlib
import errno
import io
import itertools
import os
import signal
import sys
from pathlib import Path
from typing import Any, Callable

import typer.main

from weavecore import cli, files, pipeline
from weavecore.fabricating import workshop_folder
from weavecore.reading.formats import result_json

FAULTS = {
    "EIO": lambda: _fail(errno.EIO),
    "ENOSPC": lambda: _fail(errno.ENOSPC),
    "SIGINT": lambda: os.kill(os.getpid(), signal.SIGINT),
    "SIGTERM": lambda: os.kill(os.getpid(), signal.SIGTERM),
    "SIGKILL": lambda: os._exit(137),
}
STATUSES = {"EIO": (1,), "ENOSPC": (1,), "SIGINT": (130,), "SIGTERM": (143,)}
"""Exit status after each; 0 as well where the fault could be worked round."""

EVENTS = {"open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link", "os.chmod", "os.scandir", "os.listdir"}
OUTPUTS = {"weave": ("w.json", "w.obj"), "fabricate": ("folder",), "exchange": ("folder",)}
"""Commands and what they write; ``exchange`` is ``fabricate`` where two folders cannot be exchanged in one step."""


def _fail(number: int) -> None:
    raise OSError(number, os.strerror(number))


class Calls:
    """Counts the calls on files in a folder, and makes one of them fail."""

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder)
        self.fault: Callable[[], None] = FAULTS["EIO"]
        self.count, self.fails_at = 0, -1
        self.is_on = False

    def note(self) -> None:
        if self.is_on:
            self.count += 1
            if self.count == self.fails_at:
                self.fault()

    def hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.is_on and event in EVENTS:
            path = os.fsdecode(arguments[0]) if isinstance(arguments[0], (str, bytes)) else ""
            # Names relative to an open folder are those of `shutil.rmtree`.
            if path.startswith(self._folder) or not path.startswith(os.sep):
                self.note()

    def wrapped(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, with faults before and after it."""

        def call(*arguments: Any) -> Any:
            self.note()
            result = function(*arguments)
            self.note()
            return result

        return call


class FaultyStream:
    """A file of which half the content is written when the fault comes."""

    def __init__(self, stream: Any, calls: Calls) -> None:
        self._stream, self._calls = stream, calls

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __enter__(self) -> FaultyStream:
        return self

    def __exit__(self, *_error: object) -> None:
        self._stream.close()

    def write(self, content: bytes) -> None:
        half = len(content) // 2
        self._stream.write(content[:half])
        self._stream.flush()
        self._calls.note()
        self._stream.write(content[half:])


def install(calls: Calls, command: str) -> None:
    """Put the faults between weavecore and the system."""
    sys.addaudithook(calls.hook)
    os.fsync = calls.wrapped(lambda _descriptor: None)  # Faster, and the power does not fail here.
    cli.app = typer.main.get_command(cli.app)  # Made once.
    files._swap = calls.wrapped((lambda *_: False) if command == "exchange" else files._swap)
    plain = Path.open

    def faulty_open(self: Path, mode: str = "r", *more: Any, **options: Any) -> Any:
        stream = plain(self, mode, *more, **options)
        return FaultyStream(stream, calls) if mode == "wb" else stream

    Path.open = faulty_open  # type: ignore[assignment,method-assign]


def keep_results() -> None:
    """Compute every stage once."""
    kept: dict[str, Any] = {}

    def once(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            key = f"{name} {arguments[1] if name == 'encode' else ''}"
            if key not in kept:
                kept[key] = function(*arguments, **options)
            return kept[key]

        return call

    names = {
        pipeline: ("read_surface", "offset", "link", "weave", "encode", "describe"),
        result_json: ("read_weave_or_equilibrium",),
        workshop_folder: ("fabricate_weave",),
    }
    for module, functions in names.items():
        for name in functions:
            setattr(module, name, once(name, getattr(module, name)))


def arguments_of(command: str) -> list[str]:
    if command == "weave":
        return ["weave", "tube.obj", "--spacing", "1", "--json", "w.json", "-o", "w.obj"]
    return ["fabricate", "tube.json", "-o", "folder", "--templates", "none"]


def run(command: str, *more: str) -> tuple[int, str]:
    """Status and what is on the error stream."""
    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            cli.main([*arguments_of(command), *more])
        except SystemExit as ended:
            return int(ended.code or 0), said.getvalue()
    raise AssertionError("the command must exit")


def state_of(command: str) -> list[Any]:
    """What is at each output."""

    def content(path: Path) -> Any:
        if path.is_dir():
            return {one.name: one.read_bytes() for one in path.iterdir()}
        return path.read_bytes() if path.exists() else None

    return [content(Path(name)) for name in OUTPUTS[command]]


def put(command: str, state: list[Any]) -> None:
    """Make the outputs what they were."""
    for name, content in zip(OUTPUTS[command], state):
        path = Path(name)
        if path.is_dir():
            for one in path.iterdir():
                one.unlink()
            path.rmdir()
        elif path.exists():
            path.unlink()
        if isinstance(content, dict):
            path.mkdir()
            for file, data in content.items():
                (path / file).write_bytes(data)
        elif content is not None:
            path.write_bytes(content)


def run_killed(command: str, *more: str) -> tuple[int, str]:
    """Status of a run in a process of its own, which the fault ends."""
    child = os.fork()
    if child == 0:
        os._exit(run(command, *more)[0])
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), ""


def wrong_after(command: str, fault: str, before: list[Any], new: list[Any], status: int, said: str) -> str:
    """What is wrong after a run with a fault; "" where nothing is."""
    now, parts = state_of(command), sorted(path.name for path in Path().glob(".weavecore-*"))
    if fault == "SIGKILL":
        # Each output is whole; those of a folder that was moved aside come back with the next run.
        whole = [one in pair for one, *pair in zip(now, before, new)]
        if not all(whole) and command != "exchange":
            return "neither the old output nor the new one"
        with contextlib.suppress(files.OutputExists):
            if command == "weave":
                files.check_targets(OUTPUTS[command])
            else:
                files.check_folder("folder", {**new[0], **(before[0] or {})})
        now, parts = state_of(command), sorted(path.name for path in Path().glob(".weavecore-*"))
        if not all(one in pair for one, *pair in zip(now, before, new)):
            return "the next run does not bring back the output"
        return f"left behind: {parts}" if parts else ""
    if now not in (before, new):
        return "neither all old outputs nor all new ones"
    if parts:
        return f"left behind: {parts}"
    if status not in (0, *STATUSES[fault]) or (status == 0 and now != new):
        return f"exit status {status}: {said}"
    if said.count("\n") != (status != 0):
        return f"not one line: {said}"
    return ""


def new_outputs(command: str) -> list[Any]:
    """What the command writes; of a folder three files stand for all."""
    status, said = run(command)
    assert (status, said) == (0, ""), said
    if command == "weave":
        return state_of(command)
    made = workshop_folder.fabricate_weave()
    few = type(made)({name: made.files[name] for name in sorted(made.files)[:2]}, made.checks)
    workshop_folder.fabricate_weave = lambda *_a, **_o: few
    pipeline.describe_fabrication = lambda _made: []
    put(command, [None])
    run(command)
    return state_of(command)


def walk(command: str, folder: Path) -> None:
    """Run the command with each fault at every call, with and without something at its outputs."""
    os.chdir(folder)
    keep_results()
    new = new_outputs(command)
    old = [{"bom.csv": b"old", "rods.csv": b"old"} if isinstance(one, dict) else b"old" for one in new]
    calls = Calls(folder)
    install(calls, command)
    total = 0
    starts = [old] if command == "exchange" else [old, [None for _ in new]]
    for fault, before in itertools.product(FAULTS, starts):
        more = ["--overwrite"] if before is old else []
        calls.fault = FAULTS[fault]
        for at in itertools.count(1):
            put(command, before)
            calls.count, calls.fails_at, calls.is_on = 0, at, True
            status, said = (run_killed if fault == "SIGKILL" else run)(command, *more)
            calls.is_on = False
            wrong = wrong_after(command, fault, before, new, status, said)
            if wrong:
                sys.stdout.write(f"{command} {' '.join(more)} {fault} at call {at}: {wrong}\n")
            if (status == 0) if fault == "SIGKILL" else (calls.count < at):
                break
            total += 1
    sys.stdout.write(f"{total}\n")


if __name__ == "__main__":
    walk(sys.argv[1], Path(sys.argv[2]))
