"""Summaries of results: pairs of a label and a text."""

from __future__ import annotations

from typing import Optional

import numpy as np

from weavecore.geometry.polygon_mesh import nodes_on_border
from weavecore.model import Equilibrium, Latitudes, Lattice, Replay, Strands, SurfaceMesh, Weave
from weavecore.model.lattice_fit import edge_gaps
from weavecore.model.notes import at
from weavecore.units import with_unit
from weavecore.viewing.surface_paths import describe_chosen_borders

Lines = list[tuple[str, str]]

_SHOWN_GAP = 0.05
"""Part of the spacing from which the place is shown where an edge leaves the surface by so much."""

_REGULAR_VALENCE = {"triangular": 6, "quad": 4}
"""Edges of a regular inner node, by pattern."""


def describe_surface(surface: SurfaceMesh) -> Lines:
    """Name, faces and borders, and what was repaired.

    Parameters
    ----------
    surface : SurfaceMesh
    """
    n_parts = int(surface.component_of_face.max()) + 1
    chosen, n_inside = describe_chosen_borders(surface)
    parts = [_count(surface.n_faces, "face"), _count(len(surface.borders), "border") + chosen]
    if surface.cuts:
        parts.append(_count(len(surface.cuts), "cut"))
    if n_inside:
        parts.append(_count(n_inside, "curve") + " inside")
    if n_parts > 1:
        parts.append(_count(n_parts, "component"))
    lines = [("surface", f"{surface.name or 'unnamed'}: {', '.join(parts)}")]
    return lines + [("doubt" if note.is_doubt else "note", f"{note.code}: {note.text}") for note in surface.notes]


def describe_latitudes(latitudes: Latitudes) -> Lines:
    """Spacing, generations and polylines.

    Parameters
    ----------
    latitudes : Latitudes
    """
    unit = latitudes.surface.unit
    count = f"{_count(len(latitudes), 'polyline')} in {_count(latitudes.n_generations, 'generation')}"
    n_open = int((~latitudes.polylines.closed).sum())
    if n_open:
        count += f", {n_open:,} open"
    return [
        ("spacing", spacing_text(latitudes)),
        ("latitudes", f"{count}, total length {with_unit(latitudes.polylines.lengths.sum(), unit)}"),
    ]


def spacing_text(latitudes: Latitudes) -> str:
    """The spacing, or the least and the greatest of several.

    Parameters
    ----------
    latitudes : Latitudes
    """
    steps, unit = latitudes.steps, latitudes.surface.unit
    greatest = with_unit(steps.max(), unit)
    return f"{with_unit(steps.min(), unit)} to {greatest}" if len(steps) > 1 else greatest


def describe_lattice(lattice: Lattice, strands: Strands) -> Lines:
    """Nodes and how many are regular, edges, faces and strands.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    """
    unit = lattice.latitudes.surface.unit
    nodes = f"{lattice.n_nodes:,} nodes"
    share = regular_share(lattice)
    if share is not None:
        nodes += f", {share:.0%} of the inner ones with {_REGULAR_VALENCE[lattice.pattern]} edges"
    return [
        ("edges", f"{lattice.n_edges:,}, mean length {with_unit(lattice.edge_lengths.mean(), unit)}"),
        ("nodes", nodes),
        ("faces", f"{lattice.n_faces:,}, pattern {lattice.pattern}"),
        ("strands", f"{len(strands):,}"),
        *_describe_fit(lattice),
    ]


def _describe_fit(lattice: Lattice) -> Lines:
    """How far edges leave the surface."""
    unit, spacing = lattice.latitudes.surface.unit, lattice.latitudes.spacing
    if lattice.n_edges == 0:
        return []
    gaps = edge_gaps(lattice)
    worst = int(gaps.argmax())
    share = float(gaps[worst]) / spacing
    text = f"edges at most {with_unit(float(gaps[worst]), unit)} from it, {share:.2g} of the spacing"
    if share >= _SHOWN_GAP:
        text += f", near {at(lattice.nodes[lattice.edges[worst]].mean(0))}"
    return [("on surface", text)]


_STRUTS = "; hexagonal gives straight struts between two joints, not woven rods: kagome is its weave"


def describe_weave(weave: Weave) -> Lines:
    """Rods, their order and their bending.

    Parameters
    ----------
    weave : Weave
    """
    unit = weave.lattice.latitudes.surface.unit
    ends, conflicts = _count(weave.n_ends_inside, "end"), _count(len(weave.conflicts), "conflict")
    clashes = _count(len(weave.clashes), "clash", "clashes")
    is_net = weave.lattice.pattern == "hexagonal"
    rods = f"{len(weave):,}, median length {with_unit(weave.median_length, unit)}, {ends} inside"
    if len(weave.turns):
        rods += f"; across the rings a median turn of {np.degrees(np.median(weave.turns)):.1f}° at a node"
    return [
        ("rods", rods),
        ("weave", f"{weave.over_under}, {conflicts}, {clashes}{_STRUTS * is_net}"),
        ("bending", _bending_text(weave)),
    ]


def _bending_text(weave: Weave) -> str:
    """Whether all rods can be bent to their places, and if not, where the worst is and which rod would pass there."""
    unit, bending = weave.lattice.latitudes.surface.unit, weave.bending
    rod = f"{diameters_text(weave)} {weave.material.name}"
    s = int(np.argmax(bending.utilisation))
    limit = with_unit(weave.material.least_bend * weave.diameters[s], unit)
    least = f"least radius {with_unit(bending.min_radius[s], unit)} in {weave.ids[s]}, allowed {limit}"
    n_bad = len(bending.violations)
    if n_bad == 0:
        return f"all {len(weave):,} rods bend: {rod}; {least}"
    x, y, z = bending.point_at_min[s].tolist()
    part = float((bending.largest_diameter / weave.diameters).min())
    thinner = diameters_text(weave, part=part)
    text = f"{n_bad:,} of {len(weave):,} rods exceed the allowable stress: {rod}; {least}"
    return f"{text}, at ({x:.6g}, {y:.6g}, {z:.6g}); all pass at {thinner} or thinner, or with a wider spacing"


def diameters_text(weave: Weave, *, part: float = 1.0) -> str:
    """The diameter of the rods, or of each family's where they differ.

    Parameters
    ----------
    weave : Weave
    part : float
        That the diameters are multiplied by.
    """
    unit = weave.lattice.latitudes.surface.unit
    of_family = {name: with_unit(part * size, unit) for name, size in weave.family_diameters.items()}
    if len(set(of_family.values())) == 1:
        return next(iter(of_family.values()))
    return ", ".join(f"{name} {size}" for name, size in of_family.items())


def describe_equilibrium(equilibrium: Equilibrium) -> Lines:
    """How far the rods move, what they carry, and whether they stand."""
    weave = equilibrium.weave
    unit = weave.lattice.latitudes.surface.unit
    moves = (equilibrium.departure_mean, equilibrium.departure_p95, equilibrium.departure_max)
    mean, p95, largest = (with_unit(move, unit, digits=3) for move in moves)
    worst = weave.ids[int(equilibrium.rod[np.argmax(equilibrium.stress)])]
    stress = f"at most {equilibrium.stress_max:.0f} MPa in {worst}, utilisation {equilibrium.utilisation_max:.2f}"
    forces = f"axial at most {np.abs(equilibrium.axial_force).max():.3g} N"
    forces += f", in ties {equilibrium.tie_force_size.max(initial=0.0):.3g} N"
    stands = "stable" if equilibrium.is_stable else f"unstable, {_count(equilibrium.n_negative, 'mode')}"
    if equilibrium.buckling_factor is not None:
        stands += f", first buckling factor {equilibrium.buckling_factor:.3g}"
    return [
        ("supports", f"{equilibrium.supports}; loads: {equilibrium.loads}"),
        ("departure", f"mean {mean}, 95% within {p95}, at most {largest}"),
        ("stress", stress),
        ("forces", forces),
        ("equilibrium", f"{stands}, found in {_count(equilibrium.n_steps, 'step')}"),
    ]


def describe_replay(found: Replay) -> Lines:
    """The worst steps of a building sequence.

    Parameters
    ----------
    found : Replay
    """
    weave, k, m = found.weave, found.worst, found.most_stressed
    move = with_unit(found.displacement[k], weave.lattice.latitudes.surface.unit, digits=3)
    n_open = int((~found.is_converged).sum())
    lines = [
        ("sequence", f"{_count(len(found), 'step')} of {len(weave):,} replayed"),
        ("displacement", f"at most {move} after step {found.step[k] + 1}, at node {found.node[k]}"),
        ("stress", f"at most {found.stress[m]:.0f} MPa after step {found.step[m] + 1}, in {weave.ids[found.rod[m]]}"),
    ]
    if found.spread:
        generations = ", ".join(str(g) for g in found.spread)
        lines.append(("order", f"rods of generation {generations} set far from each other in turn"))
    return lines + ([("doubt", f"{_count(n_open, 'step')} without an equilibrium")] if n_open else [])


def regular_share(lattice: Lattice) -> Optional[float]:
    """Part of the inner nodes with as many edges as the pattern has.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    float or None
        None where no node is inside, or the pattern has no regular valence.
    """
    valence = np.bincount(lattice.edges.ravel(), minlength=lattice.n_nodes)
    inner = ~nodes_on_border(lattice.face_offsets, lattice.face_nodes, lattice.n_nodes)
    if lattice.pattern not in _REGULAR_VALENCE or not inner.any():
        return None
    return float((valence[inner] == _REGULAR_VALENCE[lattice.pattern]).mean())


def _count(n: int, noun: str, nouns: str = "") -> str:
    return f"{n:,} {noun if n == 1 else nouns or noun + 's'}"
