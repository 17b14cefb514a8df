"""The command ``weavecore``: its subcommands and exit status.

Exit status: 0 done, 1 refused (one line on the error stream), 2 wrong usage, 130 stopped by the user.
What is costly to import is imported where it is used: ``--help`` answers at once.
"""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

import contextlib
import io
import os
import sys
from collections.abc import Iterator, Sequence
from typing import Annotated, NoReturn, Optional

import typer

from weavecore.commands.choose import choose
from weavecore.commands.explore import explore
from weavecore.commands.fabricate import fabricate
from weavecore.commands.info import info
from weavecore.commands.mesh import mesh
from weavecore.commands.simulate import simulate
from weavecore.commands.time_limit import stop_clock
from weavecore.commands.view import view
from weavecore.commands.weave import weave
from weavecore.errors import WeaveError

app = typer.Typer(
    name="weavecore",
    help="Turn a freeform surface into a structure woven from rods.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

REFUSED = 1
"""Exit status where weavecore raised an error of its own."""


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
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A name or sign that the terminal lacks must not end the work.
            stream.reconfigure(errors="replace")
    try:
        with _one_line_errors():
            app(arguments, prog_name="weavecore")
        sys.exit(0)
    finally:
        stop_clock()
        # A reader that has gone away, as head does, is not an error; without this Python would report one at its end.
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
    except Exception as error:  # noqa: BLE001 - a fault of the program must not end in a traceback either.
        what = f"{type(error).__name__}: {error}"
        _end(f"INTERNAL: {what}. This is a fault of weavecore: please report it with the input file.")


def _end(message: str) -> NoReturn:
    typer.echo(f"weavecore: {' '.join(message.split())}", err=True)
    sys.exit(REFUSED)
