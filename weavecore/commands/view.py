"""``weavecore view``: a page that shows a result in three dimensions."""

from pathlib import Path
from typing import Annotated

import typer

from weavecore.commands.arguments import Overwrite, Quiet, TimeLimit, ends_with
from weavecore.commands.input_file import written_line
from weavecore.commands.time_limit import timed_progress
from weavecore.viewing.terminal import part_of, show_lines


def view(
    result_file: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT.json",
            readable=False,
            help="Result of weavecore weave --json, or of simulate.",
            callback=ends_with(".json"),
        ),
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT.html", callback=ends_with(".html"), help="The page.")
    ],
    time_limit: TimeLimit = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write a page that shows the result in three dimensions and opens without a network.

    Families and generations can be shown or hidden, rods selected to see length, least radius and marks, and
    the construction played step by step.
    """
    with timed_progress(result_file, time_limit, quiet=quiet) as show_progress:
        from weavecore import pipeline

        pipeline.check_outputs([out], overwrite=overwrite, inputs=[result_file])
        show_progress(0.0, "reading")
        value = pipeline.read_result(result_file)
        pipeline.export_together(value, [out], overwrite=overwrite, progress=part_of(show_progress, 0.5, 1.0))
        lines = pipeline.describe(value)
    if not quiet:
        show_lines(lines + written_line([out]))
