"""The files of a weave at rest besides its result: tables, and the hand-over to other programs."""

from __future__ import annotations

from typing import Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.exporting.handover_file import encode_handover
from weavecore.exporting.registry import encode
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.equilibrium_tables import EQUILIBRIUM_FILES, build_equilibrium_tables
from weavecore.fabricating.tie_strength import DEFAULT_TIE
from weavecore.files import PathLike, check_folder, check_targets, write_folder, write_whole
from weavecore.model import Equilibrium, Weave
from weavecore.reading import read_result
from weavecore.units import millimetres_in


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
