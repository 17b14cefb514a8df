"""``weavecore explore``: many variants of a weave, with a table, pictures and a page."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Callable, Optional

import typer

from weavecore.commands.arguments import (
    LayerNames,
    ObjectNames,
    Quiet,
    known_material,
    known_pattern,
    length,
    numbers_of,
)
from weavecore.commands.input_file import read_input
from weavecore.units import Length, Lengths
from weavecore.viewing.terminal import progress_bar, show_lines

_ALL, _STOCK = "all", "stock"


@dataclass(frozen=True)
class Several:
    """The values of an option."""

    values: tuple[Any, ...]


def spacings_of(text: str) -> Several:
    """Parse spacings and ranges of spacings between commas.

    Parameters
    ----------
    text : str
        Such as ``20:60:5``, ``20,30,45`` or ``20mm:40mm:10mm,60mm``.

    Returns
    -------
    Several
        Of Length.

    Raises
    ------
    typer.BadParameter
    """
    found: list[Length] = []
    for part in text.split(","):
        ends = [length(one) for one in part.split(":")]
        if len(ends) == 1:
            found += ends
        elif len(ends) == 3 and len({one.unit for one in ends}) == 1:
            found += _range(part, *(one.value for one in ends), unit=ends[0].unit)
        else:
            raise typer.BadParameter(f"{part!r} is not a range; write START:STOP:STEP in one unit, such as 20:60:5")
    return Several(tuple(found))


def _range(text: str, start: float, stop: float, step: float, *, unit: str) -> list[Length]:
    from weavecore.errors import Unsupported
    from weavecore.exploring.variants import steps_between

    try:
        return [Length(value, unit) for value in steps_between(start, stop, step)]
    except Unsupported as error:
        raise typer.BadParameter(f"{text!r} is not a range; {error.remedy}") from error


def _listed(check: Callable[[str], Any]) -> Callable[[str], Several]:
    """A parser of a list between commas, each part of which is parsed or checked."""
    return lambda text: Several(tuple(check(part.strip()) for part in text.split(",")))


def _name(check: Callable[[Optional[str]], Optional[str]]) -> Callable[[str], str]:
    def known(name: str) -> str:
        check(name)
        return name

    return known


def _rod(text: str) -> Any:
    return _STOCK if text == _STOCK else length(text)


def _borders(text: str) -> Any:
    return _ALL if text == _ALL else numbers_of(text.replace("+", ",")).values


Workers = Annotated[
    Optional[int],
    typer.Option(min=1, metavar="N", help="Processes that weave; by default one for each processor."),
]


def explore(
    inputs: Annotated[list[Path], typer.Argument(metavar="INPUT…", help="One or more .3dm, .obj, .ply, .stl or .off.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="FOLDER", help="The folder to write, or one to go on in.")
    ],
    spacing: Annotated[
        Optional[Several],
        typer.Option(
            parser=spacings_of,
            metavar="LENGTHS",
            help="Distances between rings: 20,30,45 or START:STOP:STEP, 20:60:5; chosen if not given.",
        ),
    ] = None,
    pattern: Annotated[
        Several,
        typer.Option(parser=_listed(_name(known_pattern)), metavar="NAMES", help="Patterns: triangular,plain,kagome…"),
    ] = "triangular",  # type: ignore[assignment]  # typer parses the text, and shows it in the help.
    rod: Annotated[
        Several,
        typer.Option(
            parser=_listed(_rod),
            metavar="LENGTHS",
            help="Diameters of the rods: stock,3mm,5mm; stock is the thickest in which nearly all rods can be bent.",
        ),
    ] = _STOCK,  # type: ignore[assignment]
    material: Annotated[
        Several,
        typer.Option(
            parser=_listed(_name(known_material)),
            metavar="NAMES",
            help="Materials: gfrp, gfrp-short, bamboo, rattan, steel-strip.",
        ),
    ] = "gfrp",  # type: ignore[assignment]
    borders: Annotated[
        Several,
        typer.Option(
            parser=_listed(_borders),
            metavar="NUMBERS",
            help="Borders that the rings start from: all, or numbers in weavecore info, several with +: all,0,0+2.",
        ),
    ] = _ALL,  # type: ignore[assignment]
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Find where the rods come to rest; takes a few times as long.")
    ] = False,
    pages: Annotated[
        bool, typer.Option("--pages/--no-pages", help="A page of its own, of about 1 MB, for each variant.")
    ] = True,
    time_limit: Annotated[
        Optional[float],
        typer.Option(
            "--time-limit",
            min=1.0,
            metavar="SECONDS",
            help="Most time for a variant; one that takes longer gets an error, and is tried again next time.",
        ),
    ] = None,
    workers: Workers = None,
    scheduler: Annotated[
        Optional[str],
        typer.Option(metavar="ADDRESS", help="Weave on a Dask cluster, tcp://host:8786, instead of on this machine."),
    ] = None,
    layer: LayerNames = None,
    object_name: ObjectNames = None,
    quiet: Quiet = False,
) -> None:
    """Weave every combination of the options, and write a table, pictures and a page to choose from.

    Run it again to go on where it was stopped, or with more options to weave only what is new.
    """
    with progress_bar(quiet=quiet) as show_progress:
        from weavecore.exploring import explore as explore_variants
        from weavecore.exploring.executors import count_processors

        lengths = spacing.values if spacing else None
        least = Lengths(lengths).least if lengths else None
        surfaces = [
            replace(read_input(path, layers=layer, objects=object_name, spacing=least), name=path.stem)
            for path in inputs
        ]
        explored = explore_variants(
            surfaces,
            out,
            spacings=lengths,
            patterns=pattern.values,
            rods=rod.values,
            materials=material.values,
            borders=borders.values,
            simulate=simulate,
            pages=pages,
            time_limit=time_limit,
            workers=workers or count_processors(),
            scheduler=scheduler,
            progress=show_progress,
        )
    if not quiet:
        n, failed = len(explored.rows), explored.failed
        lines = [("variants", f"{n}, {explored.n_woven} woven now, {n - explored.n_woven} from earlier runs")]
        if failed:
            lines.append(("errors", f"{len(failed)}, the first in row {failed[0].number}: {failed[0].error}"))
        show_lines([*lines, ("written", f"{out / 'index.html'}, {out / 'data.csv'}")])
