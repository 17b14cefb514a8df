"""``weavecore simulate``: where a weave comes to rest, and the forces in it."""
# ruff: noqa: FA100 - typer reads the annotations, which on Python 3.9 it can do only where they are no texts.

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional

import typer

from weavecore.commands.arguments import Overwrite, Quiet, TieStrength, TimeLimit, ends_with
from weavecore.commands.input_file import written_line
from weavecore.commands.places import Force, force_of, read_loads, read_supports
from weavecore.commands.time_limit import timed_progress
from weavecore.errors import Unsupported
from weavecore.fabricating.tie_strength import DEFAULT_TIE
from weavecore.viewing.terminal import Progress, part_of, show_lines

if TYPE_CHECKING:
    from weavecore.model import Equilibrium
    from weavecore.viewing.summary import Lines

_SEGMENTS = 2
"""The fewest that let a rod bend between joints, as in the stage, which is imported only when it runs."""


def simulate(
    result_file: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT.json",
            readable=False,
            help="Result of weavecore weave --json.",
            callback=ends_with(".json"),
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="RELAXED.json", help="The result with its equilibrium: .json or .3dm."),
    ],
    supports: Annotated[
        str,
        typer.Option(
            metavar="SUPPORTS",
            help="borders, none, or FILE.3dm:LAYER: a point holds the nearest node, a curve all that it passes. "
            "A .csv holds one curve.",
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
    loads: Annotated[
        Optional[str],
        typer.Option(
            metavar="FILE.3dm:LAYER",
            help="Points with forces on the nearest nodes: user text force = x, y, z in N, or --force.",
        ),
    ] = None,
    force: Annotated[
        Optional[Force],
        typer.Option(metavar="X,Y,Z", help="Force in N on each point of --loads that states none.", parser=force_of),
    ] = None,
    segments: Annotated[int, typer.Option(min=2, max=32, help="Straight segments between two joints.")] = _SEGMENTS,
    tie_stiffness: Annotated[
        float,
        typer.Option(metavar="NM", help="Stiffness of ties against the turn of rods about them, in N·m/rad."),
    ] = 0.0,
    tie_friction: Annotated[
        Optional[float],
        typer.Option(
            metavar="N", help="Force in N at which a tie slides along a rod; by default ties keep to their marks."
        ),
    ] = None,
    buckling: Annotated[bool, typer.Option("--buckling", help="Find the first buckling factor of the loads.")] = False,
    sequence: Annotated[
        Optional[Path],
        typer.Option(
            metavar="STEPS.json",
            callback=ends_with(".json"),
            help="Replay the building sequence: displacement and stress of the unfinished weave after its steps.",
        ),
    ] = None,
    improve_sequence: Annotated[
        bool,
        typer.Option(
            "--improve-sequence",
            help="With --sequence: set the rods of the worst steps far from each other in turn where that helps.",
        ),
    ] = False,
    picture: Annotated[
        Optional[Path],
        typer.Option(
            metavar="OUT.png", callback=ends_with(".png"), help="A picture of the rods at rest, and as drawn in grey."
        ),
    ] = None,
    tables: Annotated[
        Optional[Path],
        typer.Option(
            metavar="FOLDER", help="CSV tables in mm and N: nodes, rods, ties, reactions, and their extremes."
        ),
    ] = None,
    handover: Annotated[
        Optional[Path],
        typer.Option(
            metavar="OUT.3dm",
            callback=ends_with(".3dm"),
            help="Lines, ties, supports and loads with user text for Kangaroo2 and Karamba.",
        ),
    ] = None,
    tie_strength: TieStrength = DEFAULT_TIE.strength,
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

        if improve_sequence and sequence is None:
            raise Unsupported("--improve-sequence replays no sequence", remedy="Add --sequence STEPS.json.")
        targets = [path for path in (out, picture) if path is not None]
        outputs = [*targets, *(path for path in (handover, sequence) if path is not None)]
        pipeline.check_outputs(outputs, overwrite=overwrite, inputs=[result_file])
        if tables is not None:
            pipeline.check_equilibrium_folder(tables, overwrite=overwrite)
        tell(0.0, "reading")
        weave = pipeline.read_rods(result_file)
        weave_unit = weave.lattice.latitudes.surface.unit
        held = read_supports(supports, unit=weave_unit, time_limit=time_limit)
        forces = read_loads(loads, force, unit=weave_unit, time_limit=time_limit) if loads else []
        tell_part = part_of(tell, 0.1, 0.9)
        if compensate:
            if buckling or tie_stiffness or tie_friction is not None or segments != _SEGMENTS:
                raise Unsupported(
                    "--compensate takes no --segments, --buckling, --tie-stiffness or --tie-friction",
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
                forces=forces,
                segments=segments,
                tie_stiffness=tie_stiffness,
                tie_friction=tie_friction,
                within=within,
                unit=unit,
                buckling=buckling,
                progress=tell_part,
            )
        lines: Lines = []
        if sequence is not None:
            options = {"improve": improve_sequence, "gravity": gravity, "unit": unit}
            equilibrium, lines = _replay(equilibrium, sequence, options, overwrite=overwrite, tell=tell)
        pipeline.export_together(equilibrium, targets, overwrite=overwrite, progress=part_of(tell, 0.9, 1.0))
        if tables is not None:
            pipeline.write_equilibrium_tables(
                equilibrium, tables, tie_strength=tie_strength, unit=unit, overwrite=overwrite
            )
        if handover is not None:
            pipeline.write_handover(equilibrium, handover, unit=unit, overwrite=overwrite)
        lines = pipeline.describe(equilibrium) + lines
        if sequence is not None:
            targets.append(sequence)
    if not quiet:
        written = [path for path in (*targets, tables, handover) if path is not None]
        show_lines(lines + written_line(written))


def _replay(
    equilibrium: "Equilibrium", path: Path, options: dict[str, Any], *, overwrite: bool, tell: Progress
) -> tuple["Equilibrium", "Lines"]:
    """Replay the building sequence with the supports of an equilibrium, and write its steps.

    The equilibrium that is returned has the improved sequence.
    """
    from weavecore import pipeline

    nodes = equilibrium.weave.lattice.nodes[equilibrium.is_supported]
    replayed = pipeline.replay(equilibrium.weave, supports=list(nodes) or "none", progress=tell, **options)
    pipeline.write_replay(replayed, path, overwrite=overwrite)
    return replace(equilibrium, spread=replayed.spread), pipeline.describe(replayed)
