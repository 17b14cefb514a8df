"""``weavecore choose``: the best variant of an exploration, or of a surface that is explored for it."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional

import typer

from weavecore.commands.arguments import LayerNames, ObjectNames, Quiet, length
from weavecore.commands.explore import Workers
from weavecore.commands.input_file import read_input
from weavecore.units import Length
from weavecore.viewing.terminal import progress_bar, show_lines

if TYPE_CHECKING:
    from weavecore.exploring import Row

_PATTERNS = ("triangular", "plain", "kagome")
_SPACINGS = (0.8, 1.0, 1.25)
"""What is tried of a surface: the patterns that are woven most, at spacings of a ratio of 1.25 around the wish."""


def choose(
    source: Annotated[
        Path, typer.Argument(metavar="FOLDER|INPUT", help="Folder of weavecore explore, or a file with a surface.")
    ],
    spacing: Annotated[
        Optional[Length],
        typer.Option(parser=length, metavar="LENGTH", help="The spacing that you wish for, where there is a choice."),
    ] = None,
    workers: Workers = None,
    layer: LayerNames = None,
    object_name: ObjectNames = None,
    quiet: Quiet = False,
) -> None:
    """Choose the best variant: all rods bend, then fewest ends inside, then the spacing nearest to the wish.

    Of a surface nine variants are woven: three patterns at three spacings.
    """
    from weavecore.exploring import choose_variant, describe_row, read_rows

    is_table = source.is_dir() or source.suffix.lower() == ".csv"
    if is_table:
        rows: Sequence[Row] = read_rows(source)
        wish = spacing.in_unit(rows[0].unit) if spacing and rows else None
    else:
        with progress_bar(quiet=quiet) as show_progress:
            surface = read_input(source, layers=layer, objects=object_name, spacing=spacing)
            rows, wish = _explore(surface, spacing, workers, show_progress)
    choice = choose_variant(rows, spacing=wish)
    lines = [("choice", describe_row(choice.best)), ("reason", choice.reason)]
    lines += [("then", describe_row(row)) for row in choice.runners_up]
    name = "INPUT" if is_table else str(source)
    show_lines([*lines, ("weave", _command(name, choice.best))])


def _explore(surface: Any, spacing: Optional[Length], workers: Optional[int], progress: Any) -> tuple[Any, float]:
    """The rows of a few variants, and the spacing that is wished for."""
    from weavecore.exploring import explore
    from weavecore.exploring.executors import count_processors
    from weavecore.pipeline import suggest_spacing

    wish = spacing.in_unit(surface.unit) if spacing else suggest_spacing(surface)
    with tempfile.TemporaryDirectory() as folder:
        explored = explore(
            surface,
            folder,
            spacings=[float(f"{wish * ratio:.6g}") for ratio in _SPACINGS],
            patterns=_PATTERNS,
            pages=False,
            workers=workers or count_processors(),
            progress=progress,
        )
    return explored.rows, wish


def _command(name: str, row: "Row") -> str:
    """The command that weaves a variant again."""
    inputs = row.inputs
    quoted = f'"{name}"' if " " in name else name
    options = [f"--spacing {inputs['spacing']}", f"--pattern {inputs['pattern']}", f"--material {inputs['material']}"]
    if inputs["rod"] != "stock":
        options.append(f"--rod {inputs['rod']}")
    if inputs["borders"] != "all":
        options.append(f"--borders {inputs['borders'].replace('+', ',')}")
    return f"weavecore weave {quoted} {' '.join(options)} -o woven.3dm"
