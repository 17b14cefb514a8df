"""From the distance field to the latitudes: levels, loops and bands."""

from __future__ import annotations

import numpy as np

from weavecore.errors import SpacingTooLarge, TooMuchWork
from weavecore.geometry.arrays import Floats, Ints, offsets_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.bands import find_bands, find_parents
from weavecore.offsetting.contours import Crossings, Loops, chain_loops, count_crossings, find_crossings
from weavecore.offsetting.edge_profile import place_crossings
from weavecore.offsetting.field import DistanceField
from weavecore.offsetting.ladder import Ladder, Spacing
from weavecore.offsetting.opening import open_sheet
from weavecore.offsetting.persistence import group_nodes
from weavecore.offsetting.ridges import split_ridges
from weavecore.offsetting.sheet import Sheet

MOST_POINTS = 30_000_000


def trace_latitudes(surface: SurfaceMesh, field: DistanceField, *, spacing: Spacing) -> Latitudes:
    """Trace the levels of a distance field and find the bands between them.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Finite everywhere.
    spacing : float or sequence of float
        From one level to the next, in the model's unit; of several the last goes on.

    Raises
    ------
    SpacingTooLarge
        When no level lies inside the surface.
    TooMuchWork
        When the polylines would have more than 30 million points.
    """
    ladder = Ladder.of(spacing)
    refuse_too_many_points(float(ladder.height(field.distance).max()), ladder.least)
    sheet = split_ridges(open_sheet(surface, field), surface.edge_lengths, ladder=ladder)
    regions = group_nodes(sheet, ladder=ladder)
    if not regions.band.any():
        raise too_large(float(ladder.steps[0]), least_depth(surface, field.distance))
    refuse_too_many_points(count_crossings(sheet, regions.band), ladder.least)
    crossings = find_crossings(sheet, regions.band)
    part = place_crossings(sheet, regions, crossings, ladder=ladder)
    loops = chain_loops(crossings)
    bands = find_bands(sheet, regions, crossings, loops, ladder=ladder)
    traced = crossings.level[loops.order[loops.offsets[:-1]]]
    generation = np.concatenate([np.zeros(len(sheet.origins), np.int64), traced])
    return Latitudes(
        surface=surface,
        polylines=_polylines(surface, sheet, crossings, part, loops),
        generation=generation,
        distance=ladder.distance(generation.astype(np.float64)),
        parents=find_parents(bands),
        bands=bands,
        spacing=ladder.widest(int(generation.max()) + 1),
        vertex_distance=field.distance,
    )


def _polylines(surface: SurfaceMesh, sheet: Sheet, crossings: Crossings, part: Floats, loops: Loops) -> Polylines:
    """The origins, vertex for vertex, then the traced ones."""
    origin = sheet.origins.vertices()
    origin_face, origin_barycentric = corners_at(surface, origin)
    halfedge, part = crossings.halfedge[loops.order], part[loops.order]
    deep, shallow = crossings.deep[loops.order], crossings.shallow[loops.order]
    points = sheet.points[deep] + (sheet.points[shallow] - sheet.points[deep]) * part[:, None]
    face, barycentric = sheet.locate(halfedge, part)
    counts = np.concatenate([[len(path) for path in sheet.origins.paths], np.diff(loops.offsets)])
    return Polylines(
        points=np.concatenate([surface.vertices[origin], points]),
        offsets=offsets_of(counts),
        closed=np.concatenate([sheet.origins.closed, loops.closed]),
        face=np.concatenate([origin_face, face]),
        barycentric=np.concatenate([origin_barycentric, barycentric]),
    )


def corners_at(surface: SurfaceMesh, vertices: Ints) -> tuple[Ints, Floats]:
    """A face at each of the vertices, and the barycentric coordinates of the vertex in it."""
    corner = np.empty(surface.n_vertices, np.int64)
    corner[surface.faces.ravel()[::-1]] = np.arange(3 * surface.n_faces)[::-1]
    at = corner[vertices]
    barycentric = np.zeros((len(vertices), 3))
    barycentric[np.arange(len(vertices)), at % 3] = 1.0
    return at // 3, barycentric


def refuse_too_many_points(points: float, spacing: float) -> None:
    """Raise `TooMuchWork` where so many points are too many."""
    if points > MOST_POINTS:
        raise TooMuchWork(
            f"A spacing of {spacing:g} would give about {points:.2g} points, more than {MOST_POINTS:.2g}",
            remedy=f"Take a spacing of {_round_up(spacing * points / MOST_POINTS):g} or more.",
        )


def too_large(spacing: float, depth: float) -> SpacingTooLarge:
    """The refusal of a spacing at which no polyline fits."""
    return SpacingTooLarge(
        f"A spacing of {spacing:g} leaves no room for a polyline: the surface is about {depth:.3g} deep",
        remedy=f"Take a spacing of {_round_down(depth / 2):g} or less.",
    )


def least_depth(surface: SurfaceMesh, distance: Floats) -> float:
    """How deep the surface is at least: at a vertex, or in the middle of the largest circle inside a face."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
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
