"""The command ``weavecore``.

Exit status: 0 done, 1 refused (one line on the error stream), 2 wrong usage, 130 stopped by the user.
What is costly to import is imported where it is used: ``--help`` answers at once.
"""
# ruff: noqa: FA100 - typer reads the annotations, which on Python 3.9 it can do only where they are no texts.

import contextlib
import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Callable, NoReturn, Optional

import typer

from weavecore.errors import UnitUnknown, Unsupported, WeaveError
from weavecore.units import NO_UNIT, Length, parse_length, with_unit
from weavecore.viewing.terminal import part_of, progress_bar, show_lines, show_table

if TYPE_CHECKING:
    from weavecore.model import SurfaceMesh
    from weavecore.reading import ObjectReport

Lines = list[tuple[str, str]]

app = typer.Typer(
    name="weavecore",
    help="Turn a freeform surface into a structure woven from rods.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

REFUSED = 1
_MATERIALS = "What the rods are made of: gfrp, gfrp-short, bamboo, rattan or steel-strip."


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Run the command with these arguments, by default those of the process, and exit with its status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A name or sign that the terminal lacks must not end the work.
            stream.reconfigure(errors="replace")
    try:
        with _one_line_errors():
            app(arguments, prog_name="weavecore")
        sys.exit(0)
    finally:
        # A reader that has gone away, as head does, is no error; without this Python would complain at its end.
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# ------------------------------------------------------------------------------------- what is typed


def _length(text: str) -> Length:
    try:
        return parse_length(text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


@dataclass(frozen=True)
class Plane:
    """A plane as it is typed: a point and a normal."""

    numbers: tuple[float, ...]

    @property
    def point_and_normal(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Three coordinates each."""
        return self.numbers[:3], self.numbers[3:]


def _plane(text: str) -> Plane:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 6 or not all(abs(x) < float("inf") for x in numbers) or not any(numbers[3:]):
        raise typer.BadParameter(f"{text!r} is no plane; give x,y,z,nx,ny,nz: a point and a normal that is not 0")
    return Plane(numbers)


def _ends_with(ending: str) -> Callable[[Optional[Path]], Optional[Path]]:
    def check(path: Optional[Path]) -> Optional[Path]:
        if path is not None and path.suffix.lower() != ending:
            raise typer.BadParameter(f"{path} must end with {ending}")
        return path

    return check


def _known_by(module: str, find: str) -> Callable[[Optional[str]], Optional[str]]:
    """A check that a name is known to a function of a module, which is imported when it is needed."""

    def check(name: Optional[str]) -> Optional[str]:
        if name is not None:
            try:
                getattr(import_module(module), find)(name)
            except Unsupported as error:
                raise typer.BadParameter(f"{error.what}. {error.remedy}") from error
        return name

    return check


_pattern = _known_by("weavecore.linking.derived", "known_pattern")
_material = _known_by("weavecore.weaving.materials", "material_named")
_style = _known_by("weavecore.weaving.styles", "style_named")


def _known_method(name: str) -> str:
    from weavecore.pipeline import METHODS

    if name not in METHODS:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(METHODS)}")
    return name


Input = Annotated[Path, typer.Argument(metavar="INPUT", help="A .3dm, .obj, .ply, .stl or .off file.")]
LayerName = Annotated[Optional[str], typer.Option("--layer", metavar="NAME", help="Layer of the surface.")]
ObjectName = Annotated[Optional[str], typer.Option("--object", metavar="NAME", help="Name or id of the surface.")]
CutPlane = Annotated[
    Optional[Plane],
    typer.Option(
        parser=_plane, metavar="X,Y,Z,NX,NY,NZ", help="Plane that cuts a closed surface in two: a point and a normal."
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that are there already.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing unless something is wrong.")]


def _show_version(wanted: bool) -> None:
    if wanted:
        import weavecore

        typer.echo(f"weavecore {weavecore.__version__}")
        raise typer.Exit


@app.callback()
def _weavecore(
    version: Annotated[bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Tell it.")] = False,
) -> None: ...


# ------------------------------------------------------------------------------------- the commands


@app.command()
def weave(
    input_file: Input,
    out: Annotated[
        Optional[Path], typer.Option("-o", "--out", metavar="OUT", help="Woven result, .3dm or another ending.")
    ] = None,
    json: Annotated[
        Optional[Path], typer.Option(metavar="OUT.json", callback=_ends_with(".json"), help="All of it as JSON.")
    ] = None,
    picture: Annotated[
        Optional[Path], typer.Option(metavar="OUT.png", callback=_ends_with(".png"), help="A picture of it.")
    ] = None,
    spacing: Annotated[
        Optional[Length],
        typer.Option(
            parser=_length, metavar="LENGTH", help="Distance between rings: 120, 120mm, 4.7in…; chosen if not given."
        ),
    ] = None,
    edge: Annotated[
        Optional[Length],
        typer.Option(parser=_length, metavar="LENGTH", help="Length of an edge; by default 2/√3 of the spacing."),
    ] = None,
    pattern: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            callback=_pattern,
            help="triangular, quad, plain, twill, hexagonal, kagome or diagonal.",
        ),
    ] = "triangular",
    rod: Annotated[
        Optional[Length],
        typer.Option(parser=_length, metavar="LENGTH", help="Diameter of the rods; by default 1/24 of the spacing."),
    ] = None,
    material: Annotated[str, typer.Option(metavar="NAME", callback=_material, help=_MATERIALS)] = "gfrp",
    over_under: Annotated[
        Optional[str],
        typer.Option(
            metavar="STYLE",
            callback=_style,
            help="stacked, plain, or twill 2/2 and the like; by default what goes with the pattern.",
        ),
    ] = None,
    layer: LayerName = None,
    object_name: ObjectName = None,
    method: Annotated[str, typer.Option(metavar="NAME", callback=_known_method, help="levels.")] = "levels",
    cut_plane: CutPlane = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Weave a surface: rings parallel to its borders, and rods that bind them.

    Lengths are in the file's own unit, or in the one that is written after them.
    """
    targets = [path for path in (out, json, picture) if path is not None]
    with progress_bar(quiet=quiet) as tell:
        from weavecore import pipeline

        pipeline.check_outputs(targets, overwrite=overwrite)
        tell(0.0, "reading")
        surface = _read(input_file, layer, object_name, cut_plane)
        chosen, distance = _spacing(surface, spacing, edge)
        latitudes = pipeline.offset(surface, spacing=distance, method=method, progress=part_of(tell, 0.1, 0.5))
        edge_length = edge.in_unit(surface.unit) if edge else None
        lattice = pipeline.link(latitudes, edge_length=edge_length, pattern=pattern, progress=part_of(tell, 0.5, 0.7))
        woven = pipeline.weave(
            lattice,
            rod_diameter=rod.in_unit(surface.unit) if rod else None,
            material=material,
            over_under=over_under,
            progress=part_of(tell, 0.7, 0.85),
        )
        options = {"input": input_file.name, "layer": layer, "object": object_name, "method": method}
        plane = {"cut_plane": cut_plane.numbers} if cut_plane else {}
        parameters = {**{key: option for key, option in options.items() if option is not None}, **plane}
        pipeline.export_together(
            woven, targets, overwrite=overwrite, parameters=parameters, progress=part_of(tell, 0.85, 1.0)
        )
        lines = pipeline.describe(woven)
    if not quiet:
        notes = {"spacing": " (chosen; set it with --spacing)"} if chosen else {}
        show_lines([(label, text + notes.get(label, "")) for label, text in lines] + _written(targets))


@app.command()
def info(input_file: Input) -> None:
    """Tell what a file holds, and of each object whether it can be woven, or why not."""
    from weavecore.pipeline import inspect_file

    report = inspect_file(input_file, guarded=True)
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


@app.command()
def mesh(
    input_file: Input,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="A .3dm, .obj, .ply, .off, .stl or .json.")],
    layer: LayerName = None,
    object_name: ObjectName = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write the triangle mesh that weave would use."""
    with progress_bar(quiet=quiet) as tell:
        from weavecore import pipeline

        pipeline.check_outputs([out], overwrite=overwrite)
        tell(0.0, "reading")
        surface = _read(input_file, layer, object_name, None)
        pipeline.export_together(
            surface, [out], overwrite=overwrite, parameters={"input": input_file.name}, progress=part_of(tell, 0.5, 1.0)
        )
        lines = pipeline.describe(surface)
    if not quiet:
        show_lines(lines + _written([out]))


# ------------------------------------------------------------------------------------- how it is done


def _read(path: Path, layer: Optional[str], name: Optional[str], plane: Optional[Plane]) -> "SurfaceMesh":
    """Read the surface, and tell its warnings in one line each."""
    from weavecore import pipeline

    cut_plane = plane.point_and_normal if plane else None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", UnitUnknown)
        surface = pipeline.read_surface(path, layer=layer, object=name, cut_plane=cut_plane, guarded=True)
    for warning in caught:
        typer.echo(f"weavecore: warning: {UnitUnknown.code}: {warning.message}", err=True)
    return surface


def _spacing(surface: "SurfaceMesh", spacing: Optional[Length], edge: Optional[Length]) -> tuple[bool, float]:
    """Whether the spacing was left to the program, and the spacing in the file's unit."""
    from weavecore import pipeline

    if spacing:
        return False, spacing.in_unit(surface.unit)
    if edge:
        return False, pipeline.spacing_for_edges(edge.in_unit(surface.unit))
    return True, pipeline.suggest_spacing(surface)


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


def _written(targets: list[Path]) -> Lines:
    if not targets:
        return [("written", "nothing; ask for files with -o, --json or --picture")]
    return [("written", ", ".join(str(path) for path in targets))]


def _row_of(one: "ObjectReport", unit: str) -> list[str]:
    lengths = ", ".join(with_unit(length, unit) for length in one.border_lengths)
    aside = f"{one.aside}; " if one.aside else ""
    return [
        one.name or one.id or "-",
        one.kind,
        one.layer or "-",
        str(one.n_faces),
        f"{one.n_borders}: {lengths}" if lengths else str(one.n_borders),
        "-" if one.euler_characteristic is None else str(one.euler_characteristic),
        f"{aside}{one.message or 'can be woven'}",
    ]
