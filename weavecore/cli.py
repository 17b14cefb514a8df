"""The command ``weavecore``: its subcommands and exit status.

Exit status: 0 done, 1 refused (one line on the error stream), 2 wrong usage; 130 stopped by the user (Ctrl-C), 143
ended by SIGTERM, 129 by SIGHUP, as shells have it: 128 and the number of the signal.
What is costly to import is imported where it is used: ``--help`` answers at once.
"""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

import contextlib
import errno
import gc
import io
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, NoReturn, Optional

import typer
from typer.core import TyperGroup

from weavecore.commands.choose import choose
from weavecore.commands.explore import explore
from weavecore.commands.fabricate import fabricate
from weavecore.commands.info import info
from weavecore.commands.mesh import mesh
from weavecore.commands.simulate import simulate
from weavecore.commands.time_limit import stop_clock
from weavecore.commands.view import view
from weavecore.commands.weave import weave
from weavecore.errors import NotWritten, WeaveError
from weavecore.texts import printable
from weavecore.threads import THREAD_VARIABLES

REFUSED = 1
"""Exit status where weavecore raised an error of its own."""

_FULL = (errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EDQUOT, errno.EBADF)
"""Errors of an output stream without a name; those of files have been made errors of weavecore's own by then."""

_BY_SIGNAL = 128
"""Exit status of a process that a signal ended, less the number of the signal."""


_GARBAGE_THRESHOLDS = (50_000, 20, 50)
"""Of `gc.set_threshold`: drawings are made of hundreds of thousands of tuples, and looking for circles among them again
and again takes a seventh of the time of a large workshop folder."""


class _Ended(BaseException):
    """A signal asks the process to end; what it has begun to write is removed on the way."""


class _Commands(TyperGroup):
    """The group of commands; one line says why a command was stopped."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            _end("stopped by the user", status=_BY_SIGNAL + signal.SIGINT)
        except _Ended as ended:
            number = signal.Signals(ended.args[0])
            _end(f"ended by {number.name}", status=_BY_SIGNAL + number)


app = typer.Typer(
    cls=_Commands,
    name="weavecore",
    help="Turn a freeform surface into a structure woven from rods.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Run the command and exit with its status.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process.

    Raises
    ------
    SystemExit
        Always.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # It was closed before the process began.
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - for as long as the process lasts.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A name or sign that the terminal lacks must not end the work.
            stream.reconfigure(errors="replace")
    _raise_on_signals()
    gc.set_threshold(*_GARBAGE_THRESHOLDS)
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    try:
        with _one_line_errors():
            try:
                app(arguments, prog_name="weavecore")
            finally:
                _flush()
        sys.exit(0)
    finally:
        stop_clock()


def _show_version(wanted: bool) -> None:
    if wanted:
        import weavecore

        typer.echo(f"weavecore {weavecore.__version__}")
        raise typer.Exit


@app.callback()
def _weavecore(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None: ...


for _command in (weave, fabricate, simulate, explore, choose, info, mesh, view):
    app.command()(_command)


@contextlib.contextmanager
def _one_line_errors() -> Iterator[None]:
    """End the process with one line and the right status, whatever is raised."""
    try:
        yield
    except WeaveError as error:
        _end(str(error))
    except MemoryError:
        _end("TOO_MUCH_WORK: the memory did not suffice. Choose a larger spacing or a coarser mesh.")
    except OSError as error:
        if error.errno not in _FULL or error.filename is not None:
            _end_with_fault(error)
        _drop_output()
        _end(
            f"{NotWritten.code}: The standard output could not be written: {error.strerror or error}. "
            "Free some space on the disk, or send it elsewhere."
        )
    except Exception as error:  # noqa: BLE001 - a fault of the program must not end in a traceback either.
        _end_with_fault(error)


def _end_with_fault(error: Exception) -> NoReturn:
    what = f"{type(error).__name__}: {error}"
    _end(f"INTERNAL: {what}. This is a fault of weavecore: please report it with the input file.")


def _flush() -> None:
    """Write what has been printed; a reader that has gone away, as head does, is not an error."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()


def _drop_output() -> None:
    """Send the rest of the output nowhere, for Python would report at its end that it cannot write it."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _raise_on_signals() -> None:
    """Let the signals by which a system ends processes run the clean-up first."""

    def end(number: int, _frame: Optional[FrameType]) -> NoReturn:
        raise _Ended(number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        # A signal that the parent has set to be ignored, as nohup does, stays ignored.
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:
            with contextlib.suppress(ValueError):  # Not in the main thread.
                signal.signal(number, end)


def _end(message: str, *, status: int = REFUSED) -> NoReturn:
    with contextlib.suppress(OSError):  # The status says it where the error stream cannot.
        typer.echo(f"weavecore: {printable(' '.join(message.split()))}", err=True)
    sys.exit(status)
