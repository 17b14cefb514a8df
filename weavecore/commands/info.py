"""``weavecore info``: the objects and curves of a file."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from weavecore.commands.arguments import Input, Overwrite, TimeLimit, ends_with
from weavecore.commands.time_limit import timed_progress
from weavecore.units import NO_UNIT, with_unit
from weavecore.viewing.terminal import show_line, show_table

if TYPE_CHECKING:
    from weavecore.reading import CurveReport, ObjectReport

_MOST_PIECES, _MOST_BORDERS = 12, 40
"""Pieces and borders of an object that are listed."""

_MOST_CURVES = 12
"""Curves that are listed; the others are counted."""


def info(
    input_file: Input,
    marks: Annotated[
        Optional[Path],
        typer.Option(
            metavar="OUT.3dm",
            callback=ends_with(".3dm"),
            help="Write bad edges, gaps, doubts and borders as coloured curves and dots.",
        ),
    ] = None,
    time_limit: TimeLimit = None,
    overwrite: Overwrite = False,
) -> None:
    """List a file's objects, pieces and borders, and whether each object can be woven, or why not."""
    from weavecore.pipeline import inspect_file, write_marks

    with timed_progress(input_file, time_limit, quiet=False) as show_progress:
        report = inspect_file(input_file, guarded=True, time_limit=time_limit, progress=show_progress)
        if marks is not None:
            write_marks(report, marks, overwrite=overwrite, inputs=[input_file])
    version = f", version {report.version}" if report.version else ""
    unit = "no unit" if report.unit == NO_UNIT else f"unit {report.unit}, tolerance {report.tolerance:g}"
    show_line(f"{input_file.name}: {report.format}{version}, {unit}")
    if report.layers:
        show_line(f"layers: {', '.join(report.layers)}")
    if report.objects:
        headings = ("object", "kind", "layer", "faces", "borders", "χ", "verdict")
        show_table(headings, [_row_of(one, report.unit) for one in report.objects], numbers=("faces", "χ"))
        for one in report.objects:
            for line in _details_of(one, report.unit):
                show_line(line)
    if report.part_names:
        show_line(f"objects and groups for --object: {', '.join(report.part_names)}")
    if report.others:
        show_line("no surfaces: " + ", ".join(f"{count} {kind}" for kind, count in report.others))
    if report.curves:
        shown = [_describe_curve(one, report.unit) for one in report.curves[:_MOST_CURVES]]
        more = f"; … ({len(report.curves)} in all)" if len(report.curves) > _MOST_CURVES else ""
        show_line(f"curves on which rings may start: {'; '.join(shown)}{more}")

    if marks is not None:
        show_line(f"written: {marks}")


def _details_of(one: "ObjectReport", unit: str) -> Iterator[str]:
    """Pieces and borders of an object that has several, and its notes."""
    from weavecore.model.notes import at

    name = one.name or one.id or "-"
    if len(one.pieces) > 1:
        largest_first = sorted(one.pieces, key=lambda piece: -piece.area)
        for number, piece in enumerate(largest_first[:_MOST_PIECES]):
            size = with_unit(piece.size, unit)
            yield f"{name}: piece {number}: {piece.n_faces:,} faces, {size} large, about {at(piece.middle)}"
        if len(largest_first) > _MOST_PIECES:
            yield f"{name}: … ({len(largest_first)} pieces in all)"
    for number, border in enumerate(one.borders[:_MOST_BORDERS] if len(one.borders) > 1 else ()):
        area = with_unit(border.area, unit) + ("" if unit == NO_UNIT else "²")
        gap = "" if border.gap is None else f", {with_unit(border.gap, unit)} from another at {at(border.at)}"
        yield f"{name}: border {number}: length {with_unit(border.length, unit)}, spans {area}{gap}"
    for note in one.notes:
        yield f"{name}: {'doubt' if note.is_doubt else 'note'} {note.code}: {note.text}"


def _describe_curve(one: "CurveReport", unit: str) -> str:
    layer = f" on {one.layer}" if one.layer else ""
    return f"{one.name or one.id}{layer}, {with_unit(one.length, unit)}{', closed' if one.is_closed else ''}"


def _row_of(one: "ObjectReport", unit: str) -> list[str]:
    borders = [f"{number}: {with_unit(length, unit)}" for number, length in enumerate(one.border_lengths)]
    aside = f"{one.aside}; " if one.aside else ""
    return [
        one.name or one.id or "-",
        one.kind,
        one.layer or "-",
        str(one.n_faces),
        ", ".join(borders) or ("none" if one.n_faces else "-"),
        "-" if one.euler_characteristic is None else str(one.euler_characteristic),
        f"{aside}{one.message if one.code else 'can be woven'}",
    ]
