"""Extraction of the latitudes from a distance field: level sets, their bands, and pruning beside free borders.

    surface + distance
      -> mesh cut open along the cuts                     cut_mesh
      -> nodes on the cut locus                           cut_locus
      -> regions between levels, simplified               simplify
      -> crossings of levels and edges, polylines         crossings
      -> bands between the polylines, and their parents   bands
      -> without polylines too close to a free border     `prune_beside_free_borders`

Work: linear in the faces and in the points of the polylines.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.errors import SpacingTooLarge, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, connected, offsets_of, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField
from weavecore.offsetting.isolines.bands import find_bands, find_parents, order_bands
from weavecore.offsetting.isolines.crossings import (
    Crossings,
    Loops,
    chain_loops,
    count_crossings,
    find_crossings,
    place_crossings,
)
from weavecore.offsetting.isolines.cut_locus import insert_cut_locus
from weavecore.offsetting.isolines.cut_mesh import CutMesh, open_along_cuts
from weavecore.offsetting.isolines.simplify import group_by_level
from weavecore.offsetting.spacing import LevelSchedule, Spacing
from weavecore.tolerances import MIN_FREE_BORDER_GAP

MAX_POINTS = 30_000_000
"""More points than this are refused: a result of several gigabytes."""


def trace_latitudes(surface: SurfaceMesh, field: DistanceField, *, spacing: Spacing) -> Latitudes:
    """Trace the levels of a distance field and find the bands between them (Yan et al. 2016, §4).

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Finite everywhere.
    spacing : float or sequence of float
        From one level to the next, in the model's unit; of several the last is repeated.

    Returns
    -------
    Latitudes

    Raises
    ------
    SpacingTooLarge
        If no level lies inside the surface.
    TooMuchWork
        If the polylines would have more than `MAX_POINTS` points.
    """
    schedule = LevelSchedule.of(spacing)
    refuse_too_many_points(float(schedule.level_index(field.distance).max()), schedule.least_spacing)
    mesh = insert_cut_locus(open_along_cuts(surface, field), surface.edge_lengths, schedule=schedule)
    regions = group_by_level(mesh, schedule=schedule)
    if not regions.band.any():
        raise too_large(float(schedule.spacings[0]), _least_depth(surface, field.distance))
    refuse_too_many_points(count_crossings(mesh, regions.band), schedule.least_spacing)
    crossings = find_crossings(mesh, regions.band)
    part = place_crossings(mesh, regions, crossings, schedule=schedule)
    loops = chain_loops(crossings)
    bands = find_bands(mesh, regions, crossings, loops, schedule=schedule)
    traced = crossings.level[loops.order[loops.offsets[:-1]]]
    generation = np.concatenate([np.zeros(len(mesh.origins), np.int64), traced])
    return Latitudes(
        surface=surface,
        polylines=_polylines(surface, mesh, crossings, part, loops),
        generation=generation,
        distance=schedule.distance_of(generation.astype(np.float64)),
        parents=find_parents(bands),
        bands=bands,
        spacing=schedule.widest_spacing(int(generation.max()) + 1),
        vertex_distance=field.distance,
    )


def _polylines(surface: SurfaceMesh, mesh: CutMesh, crossings: Crossings, part: Floats, loops: Loops) -> Polylines:
    """The origins, vertex for vertex, then the polylines of crossings."""
    origin = mesh.origins.vertices()
    origin_face, origin_barycentric = corners_at(surface, origin)
    halfedge, part = crossings.halfedge[loops.order], part[loops.order]
    deep, shallow = crossings.deep[loops.order], crossings.shallow[loops.order]
    points = mesh.points[deep] + (mesh.points[shallow] - mesh.points[deep]) * part[:, None]
    face, barycentric = mesh.locate(halfedge, part)
    counts = np.concatenate([[len(path) for path in mesh.origins.paths], np.diff(loops.offsets)])
    return Polylines(
        points=np.concatenate([surface.vertices[origin], points]),
        offsets=offsets_of(counts),
        closed=np.concatenate([mesh.origins.closed, loops.closed]),
        face=np.concatenate([origin_face, face]),
        barycentric=np.concatenate([origin_barycentric, barycentric]),
    )


def corners_at(surface: SurfaceMesh, vertices: Ints) -> tuple[Ints, Floats]:
    """Place vertices in faces.

    Parameters
    ----------
    surface : SurfaceMesh
    vertices : (n,) int64

    Returns
    -------
    face : (n,) int64
    barycentric : (n, 3) float64
        1 at the corner that is the vertex.
    """
    corner = np.empty(surface.n_vertices, np.int64)
    corner[surface.faces.ravel()[::-1]] = np.arange(3 * surface.n_faces)[::-1]
    at = corner[vertices]
    barycentric = np.zeros((len(vertices), 3))
    barycentric[np.arange(len(vertices)), at % 3] = 1.0
    return at // 3, barycentric


def refuse_too_many_points(points: float, spacing: float) -> None:
    """Refuse a result with too many points.

    Parameters
    ----------
    points : float
        Estimated number of points.
    spacing : float

    Raises
    ------
    TooMuchWork
    """
    if points > MAX_POINTS:
        raise TooMuchWork(
            f"A spacing of {spacing:g} would give about {points:.2g} points, more than {MAX_POINTS:.2g}",
            remedy=f"Take a spacing of {_round_up(spacing * points / MAX_POINTS):g} or more.",
        )


def too_large(spacing: float, depth: float) -> SpacingTooLarge:
    """Error for a spacing at which no polyline fits.

    Parameters
    ----------
    spacing, depth : float
        The spacing, and how deep the surface is.

    Returns
    -------
    SpacingTooLarge
        To be raised.
    """
    return SpacingTooLarge(
        f"A spacing of {spacing:g} leaves no room for a polyline: the surface is about {depth:.3g} deep",
        remedy=f"Take a spacing of {_round_down(depth / 2):g} or less.",
    )


def _least_depth(surface: SurfaceMesh, distance: Floats) -> float:
    """Lower bound of a surface's depth: at a vertex, or at the centre of the largest circle inside a face.

    Parameters
    ----------
    surface : SurfaceMesh
    distance : (V,) float64

    Returns
    -------
    float
    """
    area = surface.face_areas
    perimeter = surface.edge_lengths.reshape(-1, 3).sum(1)
    radius = np.divide(2.0 * area, perimeter, out=np.zeros_like(area), where=perimeter > 0)
    return float(max(distance.max(), radius.max()))


def _round_down(value: float) -> float:
    """Two significant digits, not more than the value."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.floor(value / unit) * unit)


def _round_up(value: float) -> float:
    """Two significant digits, not less than the value."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.ceil(value / unit) * unit)


def prune_beside_free_borders(latitudes: Latitudes) -> Latitudes:
    """Remove the last polylines before a free border where less than `MIN_FREE_BORDER_GAP` spacings lie beyond them.

    Between fronts from origins the last band ends in a cut locus; a free border ends it at any depth, so that no rod
    may have room there.

    Parameters
    ----------
    latitudes : Latitudes

    Returns
    -------
    Latitudes
        The same where nothing is removed.
    """
    if not latitudes.surface.is_free_border.any():
        return latitudes
    gone = _beside_free_borders(latitudes)
    return _without(latitudes, gone) if gone.any() else latitudes


def _beside_free_borders(latitudes: Latitudes) -> Bools:
    """(P,) polylines around bands without children that touch a free border and are shallow."""
    bands, closed = latitudes.bands, latitudes.polylines.closed
    band = rows_of(bands.offsets)
    n_sides = np.diff(bands.offsets)
    is_last = np.bincount(band[~bands.is_parent], minlength=len(bands)) == 0
    n_open = np.bincount(band[~closed[bands.polyline]], minlength=len(bands))
    # Around a band without handles and with closed polylines only, one more boundary than polylines is a free border.
    touches = (n_open > 0) | (bands.euler == 1 - n_sides)
    lowest = latitudes.distance[bands.polyline[bands.offsets[:-1]]]
    generation = latitudes.generation[bands.polyline[bands.offsets[:-1]]]
    step = np.append(latitudes.steps, latitudes.steps[-1])[np.minimum(generation, len(latitudes.steps))]
    is_shallow = is_last & touches & (bands.depth - lowest < MIN_FREE_BORDER_GAP * step)
    gone = np.zeros(len(latitudes), bool)
    gone[bands.polyline[is_shallow[band]]] = True
    # Of the first generation some stay: those of a band that would have no child left.
    child = ~bands.is_parent
    left = np.bincount(band[child], ~gone[bands.polyline[child]], minlength=len(bands)) > 0
    first = bands.polyline[child][~left[band[child]] & (latitudes.generation[bands.polyline[child]] == 1)]
    gone[first] = False
    return gone


def _without(latitudes: Latitudes, gone: Bools) -> Latitudes:
    bands, lines = latitudes.bands, latitudes.polylines
    band = rows_of(bands.offsets)
    side = np.flatnonzero(gone[bands.polyline])
    pair = side[np.argsort(bands.polyline[side], kind="stable")].reshape(-1, 2)
    a, b = band[pair[:, 0]], band[pair[:, 1]]
    count, merged = connected(a, b, len(bands))
    is_arc = ~lines.closed[bands.polyline[pair[:, 0]]]
    euler, depth = np.zeros(count, np.int64), np.zeros(count)
    np.add.at(euler, merged, bands.euler)
    np.subtract.at(euler, merged[a], is_arc.astype(np.int64))
    np.maximum.at(depth, merged, bands.depth)
    kept = ~gone[bands.polyline]
    number = np.cumsum(~gone) - 1
    made = order_bands(
        number[bands.polyline[kept]],
        merged[band[kept]],
        bands.is_parent[kept],
        bands.is_left[kept],
        euler,
        depth,
    )
    return replace(
        latitudes,
        polylines=_taken(lines, ~gone),
        generation=latitudes.generation[~gone],
        distance=latitudes.distance[~gone],
        parents=find_parents(made),
        bands=made,
    )


def _taken(lines: Polylines, kept: Bools) -> Polylines:
    point: Ints = np.flatnonzero(kept[lines.owner])
    offsets = offsets_of(lines.counts[kept])
    return Polylines(lines.points[point], offsets, lines.closed[kept], lines.face[point], lines.barycentric[point])
