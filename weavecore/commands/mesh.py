"""``weavecore mesh``: the triangle mesh of any surface."""

from pathlib import Path
from typing import Annotated

import typer

from weavecore.commands.arguments import Input, LayerName, ObjectName, Overwrite, Quiet
from weavecore.commands.input_file import read_input, written
from weavecore.viewing.terminal import part_of, progress_bar, show_lines


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
        surface = read_input(input_file, layer, object_name, None)
        pipeline.export_together(
            surface, [out], overwrite=overwrite, parameters={"input": input_file.name}, progress=part_of(tell, 0.5, 1.0)
        )
        lines = pipeline.describe(surface)
    if not quiet:
        show_lines(lines + written([out]))
