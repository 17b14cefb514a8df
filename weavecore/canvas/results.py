"""The results of the stages as geometry of Rhino in Grasshopper's data trees.

    latitudes   {generation; place}   one curve, and the places of its parents in the branch {generation - 1}
    lattice     {generation}          rings; longitudes by the generation where they begin
    rods        {family}              in the order L, A, B, P; layers in {family; place}

A *place* is the index of an item among those of its branch.  Before each path comes the number of the run, see `solve`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from weavecore.canvas.solve import Run
from weavecore.canvas.trees import grouped
from weavecore.errors import UnitUnknown
from weavecore.geometry.arrays import Ints, ranks_in_rows
from weavecore.geometry.polygon_mesh import fan_quads
from weavecore.model import (
    LATITUDINAL,
    LONGITUDINAL,
    POCKET,
    Latitudes,
    Lattice,
    Note,
    SurfaceMesh,
    Weave,
    first_generations,
)
from weavecore.viewing.surface_paths import origins_inside
from weavecore.weaving.strands import find_strands, part_at_latitudes

_LETTERS = "LABP"
"""The first letters of the names of rods, in the order of their branches."""


class LatitudeResults(NamedTuple):
    """Curves in a branch for each generation, and for each of them the places of its parents in the branch before."""

    curves: Any
    parents: Any


class LatticeResults(NamedTuple):
    """Nodes in the lattice's order; rings and longitudes in branches by generation; pocket edges; the faces."""

    nodes: list[Any]
    rings: Any
    longitudes: Any
    pockets: list[Any]
    mesh: Any


class RodResults(NamedTuple):
    """Of each rod, in a branch for each family: axis, name, how many rods lie under it at each joint, utilisation."""

    rods: Any
    names: Any
    layers: Any
    utilisation: Any


def draw_surface(run: Run, surface: SurfaceMesh) -> tuple[list[Any], Any]:
    """Draw a surface.

    Parameters
    ----------
    run : Run
    surface : SurfaceMesh

    Returns
    -------
    curves : list of curves
        The borders, the cuts of a closed surface, and the origins inside it.
    mesh : mesh
    """
    loops = [(loop, True) for loop in (*surface.borders, *surface.cuts)]
    if surface.starts is not None:
        inside = origins_inside(surface, surface.starts).tolist()
        paths = zip(surface.starts.paths, surface.starts.closed.tolist(), inside)
        loops += [(path, closed) for path, closed, is_inside in paths if is_inside]
    borders = [run.drawing.polyline(surface.vertices[loop], is_closed=closed) for loop, closed in loops]
    return borders, run.drawing.mesh(surface.vertices, surface.faces[:, [0, 1, 2, 2]])


def draw_doubts(run: Run, surface: SurfaceMesh) -> tuple[list[str], Any]:
    """Draw the doubts about a surface, and put each up as a warning.

    Parameters
    ----------
    run : Run
    surface : SurfaceMesh

    Returns
    -------
    texts : list of str
        One line each, with its code.
    places : tree of points
        A branch for each doubt.
    """
    doubts = warn_of_doubts(run, surface)
    texts = [f"{note.code}: {note.text}" for note in doubts]
    points = [run.drawing.points(np.asarray(note.points, np.float64).reshape(-1, 3)) for note in doubts]
    return texts, run.tree(((i,), list(items)) for i, items in enumerate(points))


def warn_of_doubts(run: Run, surface: SurfaceMesh, *, known: Iterable[Note] = ()) -> list[Note]:
    """Put up a warning for each doubt about a surface that is new.

    Parameters
    ----------
    run : Run
    surface : SurfaceMesh
        That of a result has the notes of all stages so far.
    known : iterable of Note, optional
        Notes of the stages before, which other components show.

    Returns
    -------
    list of Note
        The new doubts.
    """
    doubts = [note for note in surface.notes if note.is_doubt and note not in tuple(known)]
    for note in doubts:
        if note.code != UnitUnknown.code:  # A warning of Python's too, which `solve` puts up.
            run.warn(f"{note.code}: {note.text}")
    return doubts


def remark_of_grading(run: Run, surface: SurfaceMesh) -> None:
    """Put up a remark where the factors of a spacing vary along a ring.

    Parameters
    ----------
    run : Run
    surface : SurfaceMesh
        That of the latitudes.
    """
    for note in surface.notes:
        if note.code == "GRADED":
            run.remark(f"{note.code}: {note.text}")


def draw_latitudes(run: Run, latitudes: Latitudes) -> LatitudeResults:
    """Draw latitudes as curves, with the parents of each.

    Parameters
    ----------
    run : Run
    latitudes : Latitudes

    Returns
    -------
    LatitudeResults
    """
    lines, generation = latitudes.polylines, latitudes.generation
    curves = run.drawing.polylines(lines.points, lines.offsets, lines.closed)
    place = places_in_branches(generation)
    parents: dict[int, list[int]] = {p: [] for p in range(len(latitudes))}
    for parent, child in latitudes.parents.tolist():
        parents[child].append(int(place[parent]))
    order = np.lexsort([place, generation]).tolist()
    branches = [((int(generation[p]), int(place[p])), parents[p]) for p in order]
    return LatitudeResults(run.tree(grouped(generation, curves)), run.tree(branches))


def draw_lattice(run: Run, lattice: Lattice) -> LatticeResults:
    """Draw a lattice as points, curves along its rings and across them, edges of its pockets, and a mesh.

    Parameters
    ----------
    run : Run
    lattice : Lattice

    Returns
    -------
    LatticeResults
    """
    strands = part_at_latitudes(find_strands(lattice), lattice)
    begins = first_generations(strands, lattice)
    curves = run.drawing.polylines(lattice.nodes[strands.nodes], strands.offsets, strands.closed)
    family = {
        kind: [(begins[s], curves[s]) for s in np.flatnonzero(strands.family == kind)]
        for kind in (LATITUDINAL, LONGITUDINAL)
    }
    pocket = lattice.edges[lattice.edge_family == POCKET]
    quads = fan_quads(lattice.face_offsets, lattice.face_nodes)[0]
    return LatticeResults(
        nodes=list(run.drawing.points(lattice.nodes)),
        rings=run.tree(grouped(*_columns(family[LATITUDINAL]))),
        longitudes=run.tree(grouped(*_columns(family[LONGITUDINAL]))),
        pockets=run.drawing.lines(lattice.nodes[pocket[:, 0]], lattice.nodes[pocket[:, 1]]),
        mesh=run.drawing.mesh(lattice.nodes, quads),
    )


def draw_rods(run: Run, weave: Weave) -> RodResults:
    """Draw the axes of the rods, with the name, layers and utilisation of each.

    Parameters
    ----------
    run : Run
    weave : Weave

    Returns
    -------
    RodResults
    """
    axes, strands = weave.axes, weave.strands
    branch = family_branches(weave)
    curves = [run.drawing.spline(*axes.bspline(s)) for s in range(len(weave))]
    under = _rods_under(weave).tolist()
    ends = strands.offsets.tolist()
    place = places_in_branches(branch).tolist()
    layers = [((branch[s], place[s]), under[ends[s] : ends[s + 1]]) for s in range(len(weave))]
    return RodResults(
        rods=run.tree(grouped(branch, curves)),
        names=run.tree(grouped(branch, weave.ids)),
        layers=run.tree(sorted(layers, key=lambda part: part[0])),
        utilisation=run.tree(grouped(branch, weave.bending.utilisation.tolist())),
    )


def family_branches(weave: Weave) -> list[int]:
    """The branch of each rod: its family in the order L, A, B, P.

    Parameters
    ----------
    weave : Weave
    """
    return [_LETTERS.index(name[0]) for name in weave.ids]


def _rods_under(weave: Weave) -> Ints:
    """(M,) how many rods lie under each visit of a rod to a node; 0 where it is alone."""
    under = np.zeros(len(weave.strands.nodes), np.int64)
    under[weave.joints.visit] = weave.joints.rank
    return under


def places_in_branches(branch: ArrayLike) -> Ints:
    """Where each item lies among those of its branch.

    Parameters
    ----------
    branch : (n,) int64
    """
    order = np.argsort(branch, kind="stable")
    counts = np.bincount(branch)
    places = np.empty(len(order), np.int64)
    places[order] = ranks_in_rows(counts)
    return places


def _columns(rows: list[tuple[Any, Any]]) -> tuple[list[Any], list[Any]]:
    return [row[0] for row in rows], [row[1] for row in rows]
