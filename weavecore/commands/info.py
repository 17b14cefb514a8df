"""``weavecore info``: the objects and curves of a file."""

from typing import TYPE_CHECKING

import typer

from weavecore.commands.arguments import Input, TimeLimit
from weavecore.commands.time_limit import timed_progress
from weavecore.units import NO_UNIT, with_unit
from weavecore.viewing.terminal import show_table

if TYPE_CHECKING:
    from weavecore.reading import CurveReport, ObjectReport

_MOST_CURVES = 12
"""Curves that are listed; the others are counted."""


def info(input_file: Input, time_limit: TimeLimit = None) -> None:
    """List a file's objects and whether each can be woven, or why not."""
    from weavecore.pipeline import inspect_file

    with timed_progress(input_file, time_limit, quiet=False) as show_progress:
        report = inspect_file(input_file, guarded=True, time_limit=time_limit, progress=show_progress)
    version = f", version {report.version}" if report.version else ""
    unit = "no unit" if report.unit == NO_UNIT else f"unit {report.unit}, tolerance {report.tolerance:g}"
    typer.echo(f"{input_file.name}: {report.format}{version}, {unit}")
    if report.layers:
        typer.echo(f"layers: {', '.join(report.layers)}")
    if report.objects:
        headings = ("object", "kind", "layer", "faces", "borders", "χ", "verdict")
        show_table(headings, [_row_of(one, report.unit) for one in report.objects], numbers=("faces", "χ"))
    if report.others:
        typer.echo("no surfaces: " + ", ".join(f"{count} {kind}" for kind, count in report.others))
    if report.curves:
        shown = [_describe_curve(one, report.unit) for one in report.curves[:_MOST_CURVES]]
        more = f"; … ({len(report.curves)} in all)" if len(report.curves) > _MOST_CURVES else ""
        typer.echo(f"curves on which rings may start: {'; '.join(shown)}{more}")


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
        f"{aside}{one.message or 'can be woven'}",
    ]
