"""``weavecore weave``: from a file's surface to what is woven."""
# ruff: noqa: FA100 - typer reads the annotations, which on Python 3.9 it can do only where they are no texts.

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from weavecore.commands.arguments import (
    Borders,
    CurveNames,
    CutPlane,
    EdgeTarget,
    Input,
    LayerNames,
    ObjectNames,
    Overwrite,
    Quiet,
    TimeLimit,
    ends_with,
    known_material,
    known_method,
    known_pattern,
    known_style,
    length,
    lengths,
)
from weavecore.commands.input_file import curves_of, read_input, told_input, written
from weavecore.units import Length, Lengths
from weavecore.viewing.terminal import part_of, progress_bar, show_lines

if TYPE_CHECKING:
    from weavecore.model import SurfaceMesh
    from weavecore.offsetting.spacing import Spacing

_MATERIALS = "What the rods are made of: gfrp, gfrp-short, bamboo, rattan or steel-strip."


def weave(
    input_file: Input,
    out: Annotated[
        Optional[Path], typer.Option("-o", "--out", metavar="OUT", help="Woven result, .3dm or another ending.")
    ] = None,
    json: Annotated[
        Optional[Path], typer.Option(metavar="OUT.json", callback=ends_with(".json"), help="All of it as JSON.")
    ] = None,
    picture: Annotated[
        Optional[Path], typer.Option(metavar="OUT.png", callback=ends_with(".png"), help="A picture of it.")
    ] = None,
    spacing: Annotated[
        Optional[Lengths],
        typer.Option(
            parser=lengths,
            metavar="LENGTH",
            help="Distance between rings: 120, 120mm, 4.7in…, or several from the border on: 80,100,120; "
            "chosen if not given.",
        ),
    ] = None,
    edge: Annotated[
        Optional[Length],
        typer.Option(parser=length, metavar="LENGTH", help="Length of an edge; by default 2/√3 of the spacing."),
    ] = None,
    pattern: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            callback=known_pattern,
            help="triangular, quad, plain, twill, hexagonal, kagome or diagonal.",
        ),
    ] = "triangular",
    rod: Annotated[
        Optional[Length],
        typer.Option(
            parser=length,
            metavar="LENGTH",
            help="Diameter of the rods; by default 1/24 of the spacing, or of the edges where they are shorter.",
        ),
    ] = None,
    material: Annotated[str, typer.Option(metavar="NAME", callback=known_material, help=_MATERIALS)] = "gfrp",
    over_under: Annotated[
        Optional[str],
        typer.Option(
            metavar="STYLE",
            callback=known_style,
            help="stacked, plain, or twill 2/2 and the like; by default what goes with the pattern.",
        ),
    ] = None,
    layer: LayerNames = None,
    object_name: ObjectNames = None,
    edge_target: EdgeTarget = None,
    time_limit: TimeLimit = None,
    method: Annotated[str, typer.Option(metavar="NAME", callback=known_method, help="levels or fronts.")] = "levels",
    cut_plane: CutPlane = None,
    borders: Borders = None,
    curve: CurveNames = None,
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
        surface = read_input(
            input_file,
            layers=layer,
            objects=object_name,
            plane=cut_plane,
            edge_target=edge_target,
            spacing=spacing.least if spacing else edge,
            time_limit=time_limit,
            progress=part_of(tell, 0.0, 0.1),
        )
        surface = pipeline.start_at(
            surface,
            borders=borders.values if borders else None,
            curves=curves_of(input_file, curve, unit=surface.unit, time_limit=time_limit) if curve else None,
        )
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
        parameters = told_input(input_file, surface, layers=layer, objects=object_name, edge_target=edge_target)
        parameters["method"] = method
        if cut_plane:
            parameters["cut_plane"] = cut_plane.numbers
        if borders:
            parameters["borders"] = borders.values
        if curve:
            parameters["curves"] = curve
        pipeline.export_together(
            woven, targets, overwrite=overwrite, parameters=parameters, progress=part_of(tell, 0.85, 1.0)
        )
        lines = pipeline.describe(woven)
    if not quiet:
        notes = {"spacing": " (chosen; set it with --spacing)"} if chosen else {}
        show_lines([(label, text + notes.get(label, "")) for label, text in lines] + written(targets))


def _spacing(surface: "SurfaceMesh", spacing: Optional[Lengths], edge: Optional[Length]) -> tuple[bool, "Spacing"]:
    """Whether the spacing was left to the program, and the spacing in the file's unit."""
    from weavecore import pipeline

    if spacing:
        distances = spacing.in_unit(surface.unit)
        return False, distances if len(distances) > 1 else distances[0]
    if edge:
        return False, pipeline.spacing_for_edges(edge.in_unit(surface.unit))
    return True, pipeline.suggest_spacing(surface)
