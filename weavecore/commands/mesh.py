"""``weavecore mesh``: the triangle mesh of any surface."""

from pathlib import Path
from typing import Annotated

import typer

from weavecore.commands.arguments import (
    EdgeTarget,
    FillHoles,
    Input,
    Largest,
    LayerNames,
    ObjectNames,
    Overwrite,
    Quiet,
    Side,
    Strict,
    TimeLimit,
    Weld,
)
from weavecore.commands.input_file import Repairs, describe_input, read_input, written_line
from weavecore.commands.time_limit import timed_progress
from weavecore.viewing.terminal import part_of, show_lines


def mesh(
    input_file: Input,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="A .3dm, .obj, .ply, .off, .stl or .json.")],
    layer: LayerNames = None,
    object_name: ObjectNames = None,
    edge_target: EdgeTarget = None,
    time_limit: TimeLimit = None,
    weld: Weld = None,
    fill_holes: FillHoles = None,
    largest: Largest = False,
    side: Side = None,
    strict: Strict = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write the triangle mesh that weave would use."""
    repairs = Repairs(weld, fill_holes, largest, side, strict)
    with timed_progress(input_file, time_limit, quiet=quiet, is_fine=bool(edge_target)) as show_progress:
        from weavecore import pipeline

        pipeline.check_outputs([out], overwrite=overwrite, inputs=[input_file])
        show_progress(0.0, "reading")
        surface = read_input(
            input_file,
            layers=layer,
            objects=object_name,
            edge_target=edge_target,
            time_limit=time_limit,
            progress=part_of(show_progress, 0.0, 0.7),
            repairs=repairs,
        )
        parameters = describe_input(
            input_file, surface, layers=layer, objects=object_name, edge_target=edge_target, repairs=repairs
        )
        pipeline.export_together(
            surface, [out], overwrite=overwrite, parameters=parameters, progress=part_of(show_progress, 0.7, 1.0)
        )
        lines = pipeline.describe(surface)
    if not quiet:
        show_lines(lines + written_line([out]))
