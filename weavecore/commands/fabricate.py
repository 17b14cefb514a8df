"""``weavecore fabricate``: the folder that a workshop builds a weave from."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Callable, Optional

import typer

from weavecore.commands.arguments import Quiet, TieStrength, TimeLimit, ends_with, length
from weavecore.commands.time_limit import timed_progress
from weavecore.fabricating.tie_strength import DEFAULT_TIE
from weavecore.fabricating.workshop import OVERLAP, PAPERS, SPLICES, TEMPLATES
from weavecore.units import Length
from weavecore.viewing.terminal import show_lines

_MM = "Millimeters"
"""Unit of all lengths in the workshop folder."""

_NONE = "none"
"""Typed where no templates are wanted."""


def _kinds(text: str) -> tuple[str, ...]:
    """The templates that a text names, with commas between."""
    return () if text == _NONE else tuple(kind.strip().lower() for kind in text.split(","))


def _each_of(known: Iterable[str]) -> Callable[[str], str]:
    """A check that every name in a text is known."""
    names = tuple(known)

    def check(text: str) -> str:
        for name in _kinds(text):
            if name not in {one.lower() for one in names}:
                raise typer.BadParameter(f"{name!r} is not one of {', '.join(names)}")
        return text

    return check


def fabricate(
    result: Annotated[
        Path,
        typer.Argument(metavar="RESULT.json", readable=False, help="Result of weavecore weave --json, or of simulate."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FOLDER", help="The folder to write.")],
    stock: Annotated[
        Length, typer.Option(parser=length, metavar="LENGTH", help="Length of the bars: 6m, 12m, 6000…")
    ] = "6m",  # type: ignore[assignment]  # typer parses the text, and shows it in the help.
    splice: Annotated[
        str,
        typer.Option(
            metavar="KIND", callback=_each_of(SPLICES), help="How long rods and rings are joined: overlap or sleeve."
        ),
    ] = OVERLAP,
    overhang: Annotated[
        Optional[Length],
        typer.Option(
            parser=length,
            metavar="LENGTH",
            help="How far rods run past their outermost ties: by default ten diameters where there is room.",
        ),
    ] = None,
    kerf: Annotated[
        Optional[Length], typer.Option(parser=length, metavar="LENGTH", help="Length that the saw removes at each cut.")
    ] = None,
    templates: Annotated[
        str,
        typer.Option(
            metavar="KINDS",
            callback=_each_of(TEMPLATES),
            help="Formats of templates, drawings and labels: dxf, svg and pdf with commas between, or none.",
        ),
    ] = ",".join(TEMPLATES),
    paper: Annotated[
        str,
        typer.Option(metavar="SIZE", callback=_each_of(PAPERS), help="Paper of templates and drawings: A4 to A0."),
    ] = "A3",
    simulation: Annotated[
        Optional[Path],
        typer.Option(
            metavar="RELAXED.json",
            callback=ends_with(".json"),
            help="The same weave at rest, whose departure and forces go into the folder, where RESULT.json has none.",
        ),
    ] = None,
    tie_strength: TieStrength = DEFAULT_TIE.strength,
    unit: Annotated[
        Optional[str], typer.Option(metavar="UNIT", help="Unit of the result where it states none: mm, m, in…")
    ] = None,
    time_limit: TimeLimit = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing folder.")] = False,
    quiet: Quiet = False,
) -> None:
    """Write tables, templates, labels, drawings and a sequence of steps to build a weave from.

    All lengths are millimetres, here and in the folder, unless a unit is written after them.
    """
    with timed_progress(result, time_limit, quiet=quiet) as show_progress:
        from weavecore import pipeline

        workshop = pipeline.Workshop(
            stock=stock.in_unit(_MM),
            splice=splice.lower(),
            kerf=kerf.in_unit(_MM) if kerf else 0.0,
            templates=_kinds(templates),
            paper=paper.upper(),
        )
        made = pipeline.fabricate(
            result,
            out,
            workshop=workshop,
            simulation=simulation,
            tie_strength=tie_strength,
            overhang=overhang.in_unit(_MM) if overhang else None,
            unit=unit,
            overwrite=overwrite,
            progress=show_progress,
        )
        lines = pipeline.describe_fabrication(made)
    if not quiet:
        show_lines([*lines, ("written", f"{out}, {len(made.files)} files")])
