"""``weavecore simulate``: where a weave comes to rest, and the forces in it."""
# ruff: noqa: FA100 - typer reads the annotations, which on Python 3.9 it can do only where they are no texts.

from pathlib import Path
from typing import Annotated, Optional

import typer

from weavecore.commands.arguments import Overwrite, Quiet, TimeLimit, ends_with
from weavecore.commands.input_file import written_line
from weavecore.commands.time_limit import timed_progress
from weavecore.errors import Unsupported
from weavecore.viewing.terminal import part_of, show_lines

_SEGMENTS = 2
"""The fewest that let a rod bend between joints, as in the stage, which is imported only when it runs."""


def simulate(
    result_file: Annotated[
        Path,
        typer.Argument(metavar="RESULT.json", help="What weavecore weave --json wrote.", callback=ends_with(".json")),
    ],
    out: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="RELAXED.json", help="The result with its equilibrium: .json or .3dm."),
    ],
    supports: Annotated[
        str,
        typer.Option(
            metavar="SUPPORTS", help="borders, none, or a .3dm or .csv with curves that nodes are held along."
        ),
    ] = "borders",
    within: Annotated[
        Optional[float],
        typer.Option(
            metavar="LENGTH",
            help="Instead of --supports, hold few nodes so that none departs by more than this; "
            "with --compensate the departure that is allowed (2 mm by default).",
        ),
    ] = None,
    compensate: Annotated[
        bool,
        typer.Option(
            "--compensate",
            help="Change lengths and marks so that the rods rest where they were drawn, and hold nodes besides the "
            "supports where that does not suffice; the result holds the weave to cut.",
        ),
    ] = False,
    gravity: Annotated[
        Optional[bool],
        typer.Option(
            "--gravity/--no-gravity", help="Weight of the rods along -z; by default where there are supports."
        ),
    ] = None,
    pressure: Annotated[float, typer.Option(metavar="PA", help="Pressure on the surface from outside, in Pa.")] = 0.0,
    segments: Annotated[int, typer.Option(min=2, max=32, help="Straight segments between two joints.")] = _SEGMENTS,
    tie_stiffness: Annotated[
        float,
        typer.Option(metavar="NM", help="Stiffness of ties against the turn of rods about them, in N·m/rad."),
    ] = 0.0,
    buckling: Annotated[bool, typer.Option("--buckling", help="Find the first buckling factor of the loads.")] = False,
    sequence: Annotated[
        Optional[Path],
        typer.Option(
            metavar="STEPS.json",
            callback=ends_with(".json"),
            help="Replay the building sequence: displacement and stress of the unfinished weave after its steps.",
        ),
    ] = None,
    picture: Annotated[
        Optional[Path],
        typer.Option(
            metavar="OUT.png", callback=ends_with(".png"), help="A picture of the rods at rest, and as drawn in grey."
        ),
    ] = None,
    unit: Annotated[
        Optional[str], typer.Option(metavar="UNIT", help="Unit of the result where it states none: mm, m, in…")
    ] = None,
    time_limit: TimeLimit = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Find where the rods come to rest: how far they move, their stress, the forces in ties, and stability."""
    with timed_progress(result_file, time_limit, quiet=quiet) as tell:
        from weavecore import pipeline

        targets = [path for path in (out, picture) if path is not None]
        pipeline.check_outputs(targets + ([sequence] if sequence else []), overwrite=overwrite)
        tell(0.0, "reading")
        weave = pipeline.read_rods(result_file)
        held = pipeline.read_curves(supports) if Path(supports).suffix else supports
        tell_part = part_of(tell, 0.1, 0.9)
        if compensate:
            if buckling or tie_stiffness or segments != _SEGMENTS:
                raise Unsupported(
                    "--compensate takes no --segments, --buckling or --tie-stiffness",
                    remedy="Simulate the compensated result with them.",
                )
            equilibrium = pipeline.compensate(
                weave, supports=held, gravity=gravity, pressure=pressure, within=within, unit=unit, progress=tell_part
            ).after
        else:
            equilibrium = pipeline.simulate(
                weave,
                supports=held,
                gravity=gravity,
                pressure=pressure,
                segments=segments,
                tie_stiffness=tie_stiffness,
                within=within,
                unit=unit,
                buckling=buckling,
                progress=tell_part,
            )
        pipeline.export_together(equilibrium, targets, overwrite=overwrite, progress=part_of(tell, 0.9, 1.0))
        lines = pipeline.describe(equilibrium)
        if sequence is not None:
            nodes = equilibrium.weave.lattice.nodes[equilibrium.is_supported]
            replayed = pipeline.replay(
                equilibrium.weave,
                supports=list(nodes) or "none",
                gravity=gravity,
                unit=unit,
                progress=tell,
            )
            pipeline.write_replay(replayed, sequence, overwrite=overwrite)
            lines += pipeline.describe(replayed)
            targets.append(sequence)
    if not quiet:
        show_lines(lines + written_line(targets))
