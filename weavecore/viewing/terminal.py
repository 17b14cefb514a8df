"""Output of the commands on the terminal: lines with labels, tables, and a progress bar."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Callable

from weavecore.texts import printable

Progress = Callable[[float, str], None]
"""Called with the fraction that is done, from 0 to 1, and a label."""

_REFRESH_SECONDS = 0.1
"""Between two drawings of the bar."""

_UNLIMITED = 10_000
"""Width of a table that is not shown on a terminal: no row is wrapped."""


@contextlib.contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Progress]:
    """A bar on the error stream where that is a terminal; elsewhere nothing."""
    if quiet or not sys.stderr.isatty():
        yield lambda _fraction, _label: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    # It draws when it is told of progress, not from a thread of its own: a process that has two cannot be copied.
    with Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False) as bar:
        task = bar.add_task("", total=1.0)
        drawn = -_REFRESH_SECONDS

        def show(fraction: float, label: str) -> None:
            nonlocal drawn
            is_due = time.monotonic() - drawn >= _REFRESH_SECONDS
            bar.update(task, completed=fraction, description=escape(printable(label)), refresh=is_due)
            if is_due:
                drawn = time.monotonic()

        yield show


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """A progress callback for a part of the whole.

    Parameters
    ----------
    progress : callable
    start, end : float
        Fractions of the whole at which the part begins and ends.
    """
    return lambda fraction, label: progress(start + (end - start) * min(max(fraction, 0.0), 1.0), label)


def show_lines(lines: Iterable[tuple[str, str]]) -> None:
    """Print pairs of a label and a text, the texts aligned.

    Parameters
    ----------
    lines : iterable of (label, text)
    """
    lines = list(lines)
    width = max(len(label) for label, _ in lines)
    for label, text in lines:
        sys.stdout.write(f"{label:{width}}  {printable(text)}\n")


def show_line(text: str) -> None:
    """Print one line.

    Parameters
    ----------
    text : str
    """
    sys.stdout.write(f"{printable(text)}\n")


def show_table(headings: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Sequence[str] = ()) -> None:
    """Show a table that fits a terminal; elsewhere one line a row, however long.

    Parameters
    ----------
    headings : sequence of str
    rows : iterable of sequences of str
    numbers : sequence of str
        The headings of the columns that are flush right.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    is_terminal = sys.stdout.isatty()
    console = Console(markup=False, highlight=False, emoji=False, width=None if is_terminal else _UNLIMITED)
    table = Table(box=box.SIMPLE if is_terminal else None, pad_edge=False)
    for heading in headings:
        table.add_column(heading, justify="right" if heading in numbers else "left")
    for row in rows:
        table.add_row(*map(printable, row))
    console.print(table)
