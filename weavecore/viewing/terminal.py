"""What the command shows: lines with labels, tables, and a bar while it works."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Callable

Progress = Callable[[float, str], None]


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
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda fraction, label: bar.update(task, completed=fraction, description=escape(label))


def part_of(tell: Progress, start: float, end: float) -> Progress:
    """A progress whose 0 to 1 is a part of the whole."""
    return lambda fraction, label: tell(start + (end - start) * min(max(fraction, 0.0), 1.0), label)


def show_lines(lines: Iterable[tuple[str, str]]) -> None:
    """Show pairs of a label and a text, the texts below one another."""
    lines = list(lines)
    width = max(len(label) for label, _ in lines)
    for label, text in lines:
        sys.stdout.write(f"{label:{width}}  {text}\n")


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
    console = Console(markup=False, highlight=False, emoji=False, width=None if is_terminal else 10_000)
    table = Table(box=box.SIMPLE if is_terminal else None, pad_edge=False)
    for heading in headings:
        table.add_column(heading, justify="right" if heading in numbers else "left")
    for row in rows:
        table.add_row(*row)
    console.print(table)
