"""``weavecore weave``: from the surface in a file to the woven rods."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Callable, Optional

import typer

from weavecore.commands.arguments import (
    Borders,
    CurveNames,
    CutPlane,
    EdgeTarget,
    FillHoles,
    Input,
    Largest,
    LayerNames,
    ObjectNames,
    Overwrite,
    Quiet,
    Reach,
    RodDiameters,
    Side,
    SpacingFactor,
    SpacingFactors,
    Strict,
    TimeLimit,
    Weld,
    ends_with,
    known_material,
    known_method,
    known_pattern,
    known_style,
    length,
    lengths,
    rod_diameters,
)
from weavecore.commands.input_file import Repairs, describe_input, read_input, written_line
from weavecore.commands.time_limit import timed_progress
from weavecore.texts import printable
from weavecore.units import Length, Lengths
from weavecore.viewing.terminal import part_of, show_lines

if TYPE_CHECKING:
    from weavecore.model import Latitudes, SurfaceMesh

_MATERIALS = "What the rods are made of: gfrp, gfrp-short, bamboo, rattan or steel-strip."


def weave(
    input_file: Input,
    out: Annotated[
        Optional[Path],
        typer.Option("-o", "--out", metavar="OUT", help="The rods: .3dm, .json, .html, .obj, .ply or .off."),
    ] = None,
    json: Annotated[
        Optional[Path],
        typer.Option(
            metavar="OUT.json", callback=ends_with(".json"), help="The result for fabricate, view and simulate."
        ),
    ] = None,
    picture: Annotated[
        Optional[Path], typer.Option(metavar="OUT.png", callback=ends_with(".png"), help="A picture of the rods.")
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
        typer.Option(
            parser=length,
            metavar="LENGTH",
            help="Distance between the nodes of a ring: by default the spacing (quad, plain, twill) or 2/√3 of it "
            "(triangular, hexagonal, kagome, diagonal). Without --spacing it sets the spacing too.",
        ),
    ] = None,
    pattern: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            callback=known_pattern,
            help="triangular, quad, plain, twill, kagome, diagonal, or hexagonal (struts, not a weave: see kagome).",
        ),
    ] = "triangular",
    rod: Annotated[
        Optional[RodDiameters],
        typer.Option(
            parser=rod_diameters,
            metavar="LENGTH",
            help="Diameter of the rods: 3mm, or by family: latitudinal=3mm,longitudinal=2mm,pocket=2mm; by default the "
            "thickest sold in which nearly all of them can be bent.",
        ),
    ] = None,
    stock: Annotated[
        Optional[Lengths],
        typer.Option(
            parser=lengths,
            metavar="LENGTHS",
            help="Diameters to choose from: 1mm,1.5mm,3mm; by default those in which the material is sold.",
        ),
    ] = None,
    material: Annotated[str, typer.Option(metavar="NAME", callback=known_material, help=_MATERIALS)] = "gfrp",
    over_under: Annotated[
        Optional[str],
        typer.Option(
            metavar="STYLE",
            callback=known_style,
            help="Order of over and under: stacked, plain, twill 2/2 and the like; by default that of the pattern.",
        ),
    ] = None,
    free_rings: Annotated[
        bool, typer.Option("--free-rings", help="Let rings leave their exact distance where that lets rods bend less.")
    ] = False,
    layer: LayerNames = None,
    object_name: ObjectNames = None,
    edge_target: EdgeTarget = None,
    time_limit: TimeLimit = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            callback=known_method,
            help="How rings are found: levels of the distance, or fronts, step by step as in the paper.",
        ),
    ] = "levels",
    cut_plane: CutPlane = None,
    borders: Borders = None,
    curve: CurveNames = None,
    spacing_at: SpacingFactors = None,
    reach: Reach = None,
    weld: Weld = None,
    fill_holes: FillHoles = None,
    largest: Largest = False,
    side: Side = None,
    strict: Strict = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Weave a surface: rings parallel to its borders, and rods that bind them.

    Lengths are in the unit of the file, or in the one that is written after them: 120, 120mm, 4.7in.
    """
    targets = [path for path in (out, json, picture) if path is not None]
    repairs = Repairs(weld, fill_holes, largest, side, strict)
    with timed_progress(input_file, time_limit, quiet=quiet, is_fine=bool(edge_target)) as show_progress:
        from weavecore import pipeline

        pipeline.check_outputs(targets, overwrite=overwrite, inputs=[input_file])
        show_progress(0.0, "reading")
        spacing = spacing or _spacing_for(edge, pattern)
        surface = read_input(
            input_file,
            layers=layer,
            objects=object_name,
            plane=cut_plane,
            edge_target=edge_target,
            spacing=spacing.least if spacing else None,
            time_limit=time_limit,
            progress=part_of(show_progress, 0.0, 0.1),
            repairs=repairs,
            borders=borders.values if borders else None,
            curves=curve,
        )
        field = _spacing_field(spacing_at, reach, surface.unit)
        latitudes = _offset(surface, spacing, field, method=method, strict=strict, progress=show_progress)
        lattice = pipeline.link(
            latitudes,
            edge_length=edge.in_unit(surface.unit) if edge else None,
            pattern=pattern,
            free_rings=free_rings,
            progress=part_of(show_progress, 0.5, 0.7),
        )
        if strict:
            pipeline.refuse_doubts(lattice.latitudes.surface)
        woven = pipeline.weave(
            lattice,
            rod_diameter=rod.in_unit(surface.unit) if rod else None,
            stock=stock.in_unit(surface.unit) if stock else None,
            material=material,
            over_under=over_under,
            progress=part_of(show_progress, 0.7, 0.85),
        )
        parameters = describe_input(
            input_file,
            surface,
            layers=layer,
            objects=object_name,
            edge_target=edge_target,
            repairs=repairs,
            method=method,
            cut_plane=cut_plane.numbers if cut_plane else None,
            borders=borders.values if borders else None,
            curves=[printable(name) for name in curve or ()] or None,
            **field,
        )
        pipeline.export_together(
            woven, targets, overwrite=overwrite, parameters=parameters, progress=part_of(show_progress, 0.85, 1.0)
        )
        lines = pipeline.describe(woven)
    if not quiet:
        notes = {} if spacing else {"spacing": " (chosen; set it with --spacing)"}
        show_lines([(label, text + notes.get(label, "")) for label, text in lines] + written_line(targets))


def _spacing_for(edge: Optional[Length], pattern: str) -> Optional[Lengths]:
    """The spacing that goes with an edge, where one is given."""
    from weavecore import pipeline

    if edge is None:
        return None
    return Lengths((replace(edge, value=pipeline.spacing_for_edges(edge.value, pattern=pattern)),))


def _spacing_field(factors: Optional[list[SpacingFactor]], reach: Optional[Length], unit: str) -> dict[str, Any]:
    """What is given of the points with factors and of their reach, as `weavecore.offset` takes it."""
    field: dict[str, Any] = {"factors": [(one.point, one.factor) for one in factors]} if factors else {}
    return {**field, "reach": reach.in_unit(unit)} if reach else field


def _offset(
    surface: "SurfaceMesh",
    spacing: Optional[Lengths],
    field: dict[str, Any],
    *,
    method: str,
    strict: bool,
    progress: Callable[[float, str], None],
) -> "Latitudes":
    """Offset a surface, and with ``strict`` refuse one about which there are doubts."""
    from weavecore import pipeline

    wanted = spacing.in_unit(surface.unit) if spacing else None
    progress = part_of(progress, 0.1, 0.5)
    latitudes = pipeline.offset(surface, spacing=wanted, method=method, progress=progress, **field)
    if strict:
        pipeline.refuse_doubts(latitudes.surface)
    return latitudes
