"""The tables of a weave at rest: where its nodes stand, and the forces in rods, ties and supports.

::

    equilibrium   one row: supports, loads, stability and the extremes of what follows
    departures    a node: as drawn, at rest, the distance of the two, and the load on it
    rod_forces    a rod: the extremes along it
    tie_forces    a tie: the force between the two rods that it holds
    reactions     a supported node: the force of the support on the rods

Lengths are in millimetres, forces in N, moments in N·m, stresses in MPa.
"""

from __future__ import annotations

import numpy as np

from weavecore.fabricating.csv_tables import Table, mm, number, yes_no
from weavecore.fabricating.marks import joint_name
from weavecore.fabricating.tie_strength import DEFAULT_TIE, checked_tie_strength
from weavecore.model import FAMILIES, Equilibrium

EQUILIBRIUM_TABLES = ("equilibrium", "departures", "rod_forces", "tie_forces", "reactions")
EQUILIBRIUM_FILES = tuple(f"{name}.csv" for name in EQUILIBRIUM_TABLES)
"""All files that are written here."""

_FORCE_DIGITS = 6
"""Forces are written to a micronewton: self-weight of a short rod is of the order of a millinewton."""

_RATIO_DIGITS = 6


def build_equilibrium_tables(
    equilibrium: Equilibrium, *, scale: float, tie_strength: float = DEFAULT_TIE.strength
) -> list[Table]:
    """Build all tables of a weave at rest.

    Parameters
    ----------
    equilibrium : Equilibrium
    scale : float
        Millimetres in one unit of the model.
    tie_strength : float
        What a tie carries, in N.

    Returns
    -------
    list of Table

    Raises
    ------
    Unsupported
        Where the strength is not positive.
    """
    checked_tie_strength(tie_strength)
    return [
        _summary_table(equilibrium, scale, tie_strength),
        _departures_table(equilibrium, scale),
        _rods_table(equilibrium, scale),
        _ties_table(equilibrium, tie_strength),
        _reactions_table(equilibrium, scale),
    ]


def _newtons(force: float) -> str:
    return number(force, _FORCE_DIGITS)


def _summary_table(equilibrium: Equilibrium, scale: float, tie_strength: float) -> Table:
    material = equilibrium.weave.material
    factor = equilibrium.buckling_factor
    row = {
        "supports": equilibrium.supports,
        "loads": equilibrium.loads,
        "stable": yes_no(equilibrium.is_stable),
        "buckling_factor": "" if factor is None else number(factor, 3),
        "departure_mean": mm(equilibrium.departure_mean * scale),
        "departure_p95": mm(equilibrium.departure_p95 * scale),
        "departure_max": mm(equilibrium.departure_max * scale),
        "stress_max_mpa": number(equilibrium.stress_max, 3),
        "allowable_stress_mpa": number(material.strength / material.factor, 3),
        "utilisation_max": number(equilibrium.utilisation_max, _RATIO_DIGITS),
        "tie_force_max_n": _newtons(float(equilibrium.tie_force_size.max(initial=0.0))),
        "tie_strength_n": _newtons(tie_strength),
        "reaction_max_n": _newtons(float(np.linalg.norm(equilibrium.reaction, axis=1).max())),
        "residual_n": number(equilibrium.residual, 9),
    }
    return Table("equilibrium", tuple(row), [tuple(row.values())])


def _departures_table(equilibrium: Equilibrium, scale: float) -> Table:
    drawn, move = equilibrium.weave.lattice.nodes * scale, equilibrium.node_move * scale
    columns = "node,x,y,z,x_at_rest,y_at_rest,z_at_rest,departure,supported,load_x_n,load_y_n,load_z_n"
    values = zip(
        drawn.tolist(),
        (drawn + move).tolist(),
        (equilibrium.departure * scale).tolist(),
        equilibrium.is_supported.tolist(),
        equilibrium.load.tolist(),
    )
    rows = [
        (node, *map(mm, at), *map(mm, rest), mm(departure), yes_no(held), *map(_newtons, load))
        for node, (at, rest, departure, held, load) in enumerate(values)
    ]
    return Table("departures", columns.split(","), rows)


def _rods_table(equilibrium: Equilibrium, scale: float) -> Table:
    weave = equilibrium.weave
    values = zip(
        weave.ids,
        weave.strands.family.tolist(),
        equilibrium.greatest_of_rods(equilibrium.axial_force).tolist(),
        (-equilibrium.greatest_of_rods(-equilibrium.axial_force)).tolist(),
        equilibrium.greatest_of_rods(equilibrium.moment).tolist(),
        equilibrium.greatest_of_rods(equilibrium.stress).tolist(),
        equilibrium.greatest_of_rods(equilibrium.utilisation).tolist(),
        (equilibrium.rod_departure * scale).tolist(),
    )
    columns = "rod_id,family,axial_max_n,axial_min_n,moment_max_nm,stress_max_mpa,utilisation,departure_max"
    rows = [
        (
            *(name, FAMILIES[family], _newtons(tension), _newtons(compression), _newtons(moment)),
            *(number(stress, 3), number(utilisation, _RATIO_DIGITS), mm(departure)),
        )
        for name, family, tension, compression, moment, stress, utilisation, departure in values
    ]
    return Table("rod_forces", columns.split(","), rows)


def _ties_table(equilibrium: Equilibrium, tie_strength: float) -> Table:
    weave = equilibrium.weave
    columns = "joint_id,node,lower_rod,upper_rod,apart_n,along_lower_n,along_upper_n,force_n,utilisation"
    rows = []
    values = zip(equilibrium.contact_rods.tolist(), equilibrium.tie_force.tolist(), equilibrium.tie_force_size.tolist())
    for (joint, lower, upper), parts, size in values:
        node = int(weave.joints.node[joint])
        names = joint_name(node, joint, weave.lattice.n_nodes), node, weave.ids[lower], weave.ids[upper]
        rows.append((*names, *map(_newtons, parts), _newtons(size), number(size / tie_strength, _RATIO_DIGITS)))
    return Table("tie_forces", columns.split(","), rows)


def _reactions_table(equilibrium: Equilibrium, scale: float) -> Table:
    nodes = np.flatnonzero(equilibrium.is_supported)
    places = (equilibrium.weave.lattice.nodes[nodes] * scale).tolist()
    forces = equilibrium.reaction[nodes].tolist()
    rows = [
        (node, *map(mm, place), *map(_newtons, force), _newtons(float(np.linalg.norm(force))))
        for node, place, force in zip(nodes.tolist(), places, forces)
    ]
    return Table("reactions", ["node", "x", "y", "z", "x_n", "y_n", "z_n", "force_n"], rows)
