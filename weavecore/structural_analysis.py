"""The public verbs of the structural stage: simulate, compensate and replay a weave, and write what they find."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Callable, Optional, Union

import numpy as np

from weavecore.errors import NotConverged, Unsupported
from weavecore.exporting.handover_file import encode_handover
from weavecore.exporting.registry import encode
from weavecore.exporting.replay_json import encode_replay
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.equilibrium_tables import EQUILIBRIUM_FILES, build_equilibrium_tables
from weavecore.fabricating.tie_strength import DEFAULT_TIE
from weavecore.files import PathLike, check_folder, check_targets, write_folder, write_whole
from weavecore.geometry.arrays import Floats
from weavecore.model import BuildSequence, Compensation, Equilibrium, Replay, Weave
from weavecore.polling import pollable
from weavecore.reading import read_result
from weavecore.simulating.boundary import Loads, Supports
from weavecore.simulating.compensate import compensate_weave
from weavecore.simulating.hold import hold_until_within, nodes_to_hold
from weavecore.simulating.replay import MOST_STEPS, improve_sequence, replay_sequence
from weavecore.simulating.simulate import SEGMENTS, simulate_weave
from weavecore.simulating.work import check_work
from weavecore.units import millimetres_in
from weavecore.weaving.sequence import find_sequence
from weavecore.weaving.weave import move_nodes

Progress = Callable[[float, str], None]

DOWN = (0.0, 0.0, -1.0)


@pollable
def simulate(
    weave: Weave,
    *,
    supports: Supports = "borders",
    gravity: Union[bool, Sequence[float], None] = None,
    pressure: float = 0.0,
    forces: Sequence[tuple[Any, Any]] = (),
    segments: int = SEGMENTS,
    stations: Any = None,
    tie_stiffness: float = 0.0,
    tie_friction: Optional[float] = None,
    within: Optional[float] = None,
    unit: Optional[str] = None,
    buckling: bool = False,
    progress: Optional[Progress] = None,
) -> Equilibrium:
    """Let the rods of a weave spring to where they rest (Yan et al. 2016, §1 and §6); see docs/structure.md.

    Parameters
    ----------
    weave : Weave
    supports : str or sequence of (n, 3) array_like
        ``"borders"``, ``"none"``, or points and polylines: a point holds the node nearest to it, a polyline the nodes
        that it passes.
    gravity : bool or (3,) sequence of float, optional
        Whether the rods have weight, along -z or the direction given; by default where there are supports.
    pressure : float
        In Pa, on the surface from outside.
    forces : sequence of ((3,), (3,))
        Places, and the forces in N on the nodes nearest to them.
    segments : int
        Straight segments between two joints, 2 at least.
    stations : (M,) array_like, optional
        Distance of each joint from the start of its rod where the marks differ from the drawn ones.
    tie_stiffness : float
        Of each tie against the turn of its rods about it, in N·m/rad; without it they turn freely.
    tie_friction : float, optional
        Force in N at which a tie slides along a rod; by default ties keep to their marks.
    within : float, optional
        Choose the supports: few nodes that are held so that none departs by more than this length, in the model's unit.
    unit : str, optional
        Unit of the weave where it states none: ``"mm"``, ``"m"``…
    buckling : bool
        Whether to find the first buckling factor of the loads, which takes about as long again.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Equilibrium

    Raises
    ------
    Unsupported, TooMuchWork
    NotConverged
        Where no equilibrium was found; ``reached`` is the state at which the search ended.
    """
    check_work(weave, segments)
    is_default = supports != "none" or within is not None
    loads = Loads(gravity=_direction(gravity, is_default=is_default), pressure=pressure, forces=tuple(forces))

    def at_rest(held: Supports, carried: Loads = loads, start: Optional[Floats] = None) -> Equilibrium:
        return simulate_weave(
            weave,
            supports=held,
            loads=carried,
            segments=segments,
            stations=stations,
            tie_stiffness=tie_stiffness,
            tie_friction=tie_friction,
            unit=unit,
            buckling=buckling,
            start=start if segments == SEGMENTS else None,
            progress=progress,
        )

    if within is None:
        return at_rest(supports)
    metres = millimetres_in(weave.lattice.latitudes.surface.unit, unit) / 1000.0
    none = np.zeros(weave.lattice.n_nodes, bool)
    try:
        released: Optional[Equilibrium] = at_rest("none", Loads())
    except NotConverged:
        released = None
    return hold_until_within(
        lambda held, start: at_rest(held, start=start),
        within,
        weave=weave,
        released=released,
        choose=lambda: nodes_to_hold(weave, within, is_held=none, loads=loads, metres=metres),
    )


@pollable
def compensate(
    weave: Weave,
    *,
    supports: Supports = "borders",
    gravity: Union[bool, Sequence[float], None] = None,
    pressure: float = 0.0,
    forces: Sequence[tuple[Any, Any]] = (),
    within: Optional[float] = None,
    hold: bool = True,
    unit: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Compensation:
    """Change lengths and marks so that a weave rests where it was drawn, and hold nodes where they do not suffice.

    Parameters
    ----------
    weave : Weave
    supports, gravity, pressure, forces, unit
        As for `simulate`; without supports loads act only where nodes are held.
    within : float, optional
        Departure of a node that is allowed, in the model's unit; 2 mm by default.
    hold : bool
        Whether nodes may be held besides the supports.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Compensation
        Its weave is the one to cut; `Compensation.verdict` says whether it keeps within the limit, and how.

    Raises
    ------
    Unsupported
    """
    check_work(weave, SEGMENTS)
    return compensate_weave(
        weave,
        move_nodes,
        supports=supports,
        loads=Loads(_direction(gravity, is_default=True), pressure, tuple(forces)),
        within=within,
        may_hold=hold,
        unit=unit,
        progress=progress,
    )


@pollable
def replay(
    weave: Weave,
    *,
    supports: Supports = "borders",
    gravity: Union[bool, Sequence[float], None] = None,
    most_steps: int = MOST_STEPS,
    improve: bool = False,
    unit: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Replay:
    """Find where the unfinished weave rests after steps of its building sequence, and the stress in its rods.

    Parameters
    ----------
    weave : Weave
    supports, gravity, unit
        As for `simulate`; without supports rods have no weight.
    most_steps : int
        Steps that are replayed, spread over the sequence; the last is always among them.
    improve : bool
        Whether the rods of the worst generations are set far from each other in turn where the largest displacement
        falls by it; `Replay.strand` has the order.  Takes up to four replays.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Replay

    Raises
    ------
    Unsupported
    """
    check_work(weave, SEGMENTS)

    def replayed(sequence: BuildSequence) -> Replay:
        return replay_sequence(
            weave,
            sequence,
            supports=supports,
            loads=Loads(gravity=_direction(gravity, is_default=True)),
            metres=millimetres_in(weave.lattice.latitudes.surface.unit, unit) / 1000.0,
            most_steps=most_steps,
            progress=progress,
        )

    if not improve:
        return replayed(find_sequence(weave))
    return improve_sequence(lambda spread: find_sequence(weave, spread=spread), replayed)


def write_replay(found: Replay, path: PathLike, *, overwrite: bool = False) -> None:
    """Write the steps of a replay to a .json, whole or not at all.

    Parameters
    ----------
    found : Replay
    path : path
    overwrite : bool
        Whether a file that is there already is replaced.

    Raises
    ------
    OutputExists, NotWritten
    """
    check_targets([path], overwrite=overwrite)
    write_whole(path, encode_replay(found), overwrite=overwrite)


def _direction(gravity: Union[bool, Sequence[float], None], *, is_default: bool) -> Optional[Any]:
    """Direction of the weight, None for none."""
    is_on = is_default if gravity is None else gravity is not False
    return (DOWN if gravity is None or gravity is True else gravity) if is_on else None


def simulation_of(weave: Weave, simulation: Union[Weave, Equilibrium, PathLike]) -> Optional[Equilibrium]:
    """The weave at rest, where it was simulated."""
    found = simulation if isinstance(simulation, (Weave, Equilibrium)) else read_result(simulation)
    if found is weave:
        return None
    if not isinstance(found, Equilibrium):
        raise Unsupported("The simulation has no equilibrium", remedy="Write one: weavecore simulate RESULT.json.")
    other = found.weave
    is_same = (
        other.ids == weave.ids
        and np.array_equal(other.lattice.nodes, weave.lattice.nodes)
        and np.array_equal(other.diameters, weave.diameters)
        and other.material == weave.material
    )
    if not is_same:
        raise Unsupported("The simulation is of another weave", remedy="Simulate the result that is to be built.")
    return found


def write_equilibrium_tables(
    equilibrium: Equilibrium,
    folder: PathLike,
    *,
    tie_strength: float = DEFAULT_TIE.strength,
    unit: Optional[str] = None,
    overwrite: bool = False,
) -> None:
    """Write tables of a weave at rest to a folder: departures, rod_forces, tie_forces, reactions, and their extremes.

    Parameters
    ----------
    equilibrium : Equilibrium
    folder : path
    tie_strength : float
        What a cable tie carries, in N.
    unit : str, optional
        Unit of the weave where it states none; the tables are in millimetres.
    overwrite : bool
        Whether a folder of the same kind that is there already is replaced.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    check_equilibrium_folder(folder, overwrite=overwrite)
    scale = millimetres_in(equilibrium.weave.lattice.latitudes.surface.unit, unit)
    source = Source.of(equilibrium.weave, encode(equilibrium, "result.json"))
    tables = build_equilibrium_tables(equilibrium, scale=scale, tie_strength=tie_strength)
    files = {f"{table.name}.csv": table.encode(source) for table in tables}
    write_folder(folder, files, names=EQUILIBRIUM_FILES, overwrite=overwrite)


def write_handover(
    value: Union[Weave, Equilibrium], path: PathLike, *, unit: Optional[str] = None, overwrite: bool = False
) -> None:
    """Write a weave as lines, joints, supports and loads for Kangaroo2 and Karamba; see docs/structure.md.

    Parameters
    ----------
    value : Weave or Equilibrium
        Supports and loads are those of an equilibrium.
    path : path
        Ends with ``.3dm``.
    unit : str, optional
        Unit of the weave where it states none.
    overwrite : bool
        Whether a file that is there already is replaced.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    weave = value.weave if isinstance(value, Equilibrium) else value
    metres = millimetres_in(weave.lattice.latitudes.surface.unit, unit) / 1000.0
    check_targets([path], overwrite=overwrite)
    write_whole(path, encode_handover(value, metres=metres), overwrite=overwrite)


def check_equilibrium_folder(folder: PathLike, *, overwrite: bool = False) -> None:
    """Raise what `write_equilibrium_tables` would raise of the folder alone, before any work is done."""
    check_folder(folder, EQUILIBRIUM_FILES, overwrite=overwrite)
