"""What the report checks of a weave at rest, measured on the written tables.

Loads and reactions are in balance, `F_loads + F_reactions = 0`; rods and ties carry what the equilibrium asks of them;
the row of extremes is that of the tables.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.fabricating.csv_tables import ReadTable
from weavecore.fabricating.equilibrium_tables import EQUILIBRIUM_FILES
from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, greatest_of
from weavecore.geometry.arrays import Floats

_ROUNDING = 0.002
"""Lengths are written to a micrometre: the difference of two may be off by so many millimetres."""

_BALANCE = 1e-3
"""Largest part of the loads that the reactions may miss: solver and rounding leave less."""

_FORCE_ROUNDING = 1e-6
"""Forces are written to so many newtons."""


def check_equilibrium(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check the tables of a weave at rest, where the folder has them.

    Parameters
    ----------
    folder : WrittenFolder
    """
    if not set(EQUILIBRIUM_FILES) <= folder.files.keys():
        return
    summary, nodes = folder.table("equilibrium"), folder.table("departures")
    rods, ties = folder.table("rod_forces"), folder.table("tie_forces")
    stable = summary["stable"][0] == "yes"
    yield CheckResult("equilibrium_not_stable", 0.0 if stable else 1.0, 0.0)
    move = np.linalg.norm(_columns(nodes, "x_at_rest,y_at_rest,z_at_rest") - _columns(nodes, "x,y,z"), axis=1)
    yield greatest_of(
        "equilibrium_departure_off_mm", np.abs(move - nodes.floats("departure")), _ROUNDING, nodes["node"]
    )
    yield CheckResult("equilibrium_departure_mm", float(move.max(initial=0.0)), float("inf"))
    yield greatest_of("equilibrium_utilisation", rods.floats("utilisation"), 1.0, rods["rod_id"])
    yield greatest_of(
        "tie_force_n", ties.floats("force_n"), float(summary.floats("tie_strength_n")[0]), ties["joint_id"]
    )
    reactions = folder.table("reactions")
    yield CheckResult("reaction_n", float(reactions.floats("force_n").max(initial=0.0)), float("inf"))
    yield _balance(nodes, reactions)
    yield _off_summary(summary, {"departure_max": move, "tie_force_max_n": ties.floats("force_n")})


def _columns(table: ReadTable, names: str) -> Floats:
    return np.stack([table.floats(name) for name in names.split(",")], axis=1)


def _balance(nodes: ReadTable, reactions: ReadTable) -> CheckResult:
    """What loads and reactions leave over."""
    loads = _columns(nodes, "load_x_n,load_y_n,load_z_n")
    left = loads.sum(0) + _columns(reactions, "x_n,y_n,z_n").sum(0)
    rounding = _FORCE_ROUNDING * (len(nodes) + len(reactions))
    limit = _BALANCE * float(np.linalg.norm(loads, axis=1).sum()) + rounding
    return CheckResult("loads_not_carried_n", float(np.linalg.norm(left)), limit)


def _off_summary(summary: ReadTable, measured: dict[str, Floats]) -> CheckResult:
    off = [abs(float(values.max(initial=0.0)) - float(summary.floats(key)[0])) for key, values in measured.items()]
    return greatest_of("equilibrium_extremes_off", np.array(off), _ROUNDING, tuple(measured))
