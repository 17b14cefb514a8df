"""Distance of every vertex from the origins, along the surface: window propagation with rays.

1. Rays start at right angles to the origins (`ray_seeds`) and run straight over the surface (`rays`).
2. Every `STRIDE` the front is compared at one distance: gaps are filled, crowded rays removed, faces left behind
   entered again (`front`), and free borders have their pseudo-sources (`reflected_double`).
3. The few faces on which the distance rises faster than the way is long are corrected from their neighbours
   (`relaxation`).

Each ray is the straightest geodesic of Yan et al. 2016, §4.2.  Exact methods keep windows on every edge (Mitchell,
Mount and Papadimitriou 1987); here one ray stands for a window of about half an edge, and what lies between two rays is
measured from the circle through the nearer one.  Work is linear in the faces: each is crossed by a bounded number of
rays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.errors import TooMuchWork
from weavecore.geometry.arrays import Floats, frozen
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.front import FrontSnapshot, UnsweptFaces, fill_gaps, measure_growth, thin
from weavecore.offsetting.distance.ray_seeds import seed_rays
from weavecore.offsetting.distance.rays import GeodesicRays, TentativeDistances, advance, offer_at_start
from weavecore.offsetting.distance.reflected_double import (
    PseudoSources,
    reflected_double,
    unlink_across_free_borders,
)
from weavecore.offsetting.distance.relaxation import relax_sources
from weavecore.polling import poll

Progress = Optional[Callable[[float, str], None]]

STRIDE = 3.0
"""Median edge lengths between two comparisons of the front: a gap grows by 1 + k s, so it at most doubles on the way
where the front's radius is three edges or more."""

MOST_STRIDES = 5_000
"""Strides from one end of the surface to the other: each takes some milliseconds, however few rays there are, and a
mesh of even edges that is so many strides wide would have a hundred million faces."""

MOST_STEPS = 50_000
"""Steps of rays across faces, of which each takes about 0.2 ms: ordinary surfaces take 50 to 1,000, a spike of needles,
around which rays wind, millions."""

_CROSSED_A_STEP = 100  # faces that many rays cross in the time of one step of few rays
_MOST_CROSSED_A_FACE = 20  # ordinary surfaces: 2 to 11

_NO_GAP = 1e-12  # added to the gaps at the start, which are 0 where a fan leaves a corner: 0 would read as unknown


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distance from the origins along the surface.

    Parameters
    ----------
    distance : (V,) float64
        In the model's unit; 0 on the origins.
    gradient : (V, 3) float64
        Direction in which the shortest path arrives at each vertex: a unit vector tangent to a face there, pointing
        away from the origins.  Zero on the origins, and where the direction is not known.
    """

    distance: Floats
    gradient: Floats

    def __post_init__(self) -> None:
        n = len(self.distance)
        object.__setattr__(self, "distance", frozen(self.distance, np.float64, (n,)))
        object.__setattr__(self, "gradient", frozen(self.gradient, np.float64, (n, 3)))


_MEASURED: WeakKeyDictionary[SurfaceMesh, tuple[int, DistanceField]] = WeakKeyDictionary()
"""Fields that a suggested spacing was found with, and the limit of their steps: the offset that follows takes them."""


def measure_distance(surface: SurfaceMesh, *, most_steps: int = MOST_STEPS, progress: Progress = None) -> DistanceField:
    """Measure the distance from the origins along the surface.

    Parameters
    ----------
    surface : SurfaceMesh
        Each component has an origin.
    most_steps : int
        More steps of rays are refused.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    DistanceField
        Distance and direction at every vertex, in the model's unit.

    Raises
    ------
    TooMuchWork
        If the surface is too wide for its median edge, or its faces are such needles that rays take too many steps.
    """
    known = _MEASURED.get(surface)
    if known is not None and known[0] <= most_steps:
        return known[1]
    _check_width(surface)
    frames, scale = _frames_of(surface)
    tentative = _propagate(frames, surface, most_steps, progress)
    gradient = relax_sources(frames, tentative)
    n = surface.n_vertices
    field = DistanceField(tentative.distance[:n] * scale, gradient[:n])
    if most_steps < MOST_STEPS:
        _MEASURED[surface] = most_steps, field
    return field


def _check_width(surface: SurfaceMesh) -> None:
    """Refuse a surface that is so wide in median edge lengths that the strides alone would take minutes."""
    poll()
    edge = float(np.median(surface.edge_lengths))
    width = float(np.ptp(surface.vertices, axis=0).max())
    if width > MOST_STRIDES * STRIDE * edge:
        middle = np.median(surface.vertices, axis=0)
        x, y, z = surface.vertices[np.linalg.norm(surface.vertices - middle, axis=1).argmax()]
        raise TooMuchWork(
            f"The surface is {width:.4g} wide, {width / edge:,.0f} times the median edge of its mesh ({edge:.4g}); "
            f"the vertex farthest off lies at ({x:.6g}, {y:.6g}, {z:.6g})",
            remedy="Remove that vertex if it is stray, weave pieces of very different size one by one, or give the "
            "mesh edges of more equal length.",
        )


def _too_many_steps(surface: SurfaceMesh) -> TooMuchWork:
    squares = surface.edge_lengths.reshape(-1, 3) ** 2
    face = int((squares.max(1) / np.maximum(squares.min(1), np.finfo(float).tiny)).argmax())
    x, y, z = surface.vertices[surface.faces[face]].mean(0)
    longest, shortest = np.sqrt(squares[face].max()), np.sqrt(squares[face].min())
    return TooMuchWork(
        f"Distances take too long to measure on edges of such different lengths; the face where they differ most, "
        f"{longest:.4g} by {shortest:.4g}, lies at ({x:.6g}, {y:.6g}, {z:.6g})",
        remedy="Remesh the surface with edges of more equal length, or remove a vertex that lies far off.",
        ids=[face],
        kind="face",
    )


def _frames_of(surface: SurfaceMesh) -> tuple[Unfolding, float]:
    """Frames of the mesh, or of its reflected double if it has free borders, in median edge lengths about 0."""
    poll()
    centred = surface.vertices - surface.vertices.mean(axis=0)
    scale = float(np.median(surface.edge_lengths)) or 1.0
    if surface.is_free_border.any():
        vertex, faces, twins = reflected_double(surface)
        return Unfolding(centred[vertex] / scale, faces, twins), scale
    twins = np.where(surface.is_cut, NO_TWIN, surface.twins)
    return Unfolding(centred / scale, surface.faces, twins), scale


def _propagate(frames: Unfolding, surface: SurfaceMesh, most_steps: int, progress: Progress) -> TentativeDistances:
    """Advance the front by one stride after another until nothing is left to reach.

    It ends when no ray moves and no face waits.  It also ends once the front has come further than the furthest vertex
    reached, by a stride (rays only go round where all is measured) or, while faces wait, by two of the longest edges
    more (a face is entered again within two of its own edges, so those that still wait cannot be reached).  The front's
    distance grows by a stride each round and a reached distance is at most the sum of all edges; so the loop ends.
    """
    tentative = TentativeDistances(frames, np.flatnonzero(frames.on_boundary))
    unswept, pseudo_sources = UnsweptFaces(frames), PseudoSources(frames, surface)
    rays = seed_rays(frames)
    unlink_across_free_borders(rays, surface)
    rays.links.gap = FrontSnapshot(frames, rays, 0.0).gap + _NO_GAP
    offer_at_start(frames, tentative, rays)
    distance, kept = 0.0, 0
    while len(rays) or not unswept.is_empty:
        distance += STRIDE
        advance(frames, tentative, rays, distance)
        rays = rays.without(rays.stopped())
        new = pseudo_sources.rays_from_reached(frames, tentative, distance)
        rays = _joined(frames, tentative, rays, new, distance)
        unlink_across_free_borders(rays, surface)
        rays = _repair_front(frames, tentative, rays, unswept, distance)
        kept += len(rays)
        crossed = tentative.n_crossed + kept - _MOST_CROSSED_A_FACE * surface.n_faces
        if tentative.n_steps + distance / STRIDE + max(crossed, 0) / _CROSSED_A_STEP > most_steps:
            raise _too_many_steps(surface)
        if progress is not None:
            progress(float(np.isfinite(tentative.distance).mean()), "offsetting the borders")
        if distance > tentative.distance[tentative.last_reached] + STRIDE:  # else one vertex shows that it goes on
            reached = tentative.distance[np.isfinite(tentative.distance)].max()
            if distance > reached + STRIDE + (0.0 if unswept.is_empty else 2 * frames.length.max()):
                break
    return tentative


def _repair_front(
    frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays, unswept: UnsweptFaces, distance: float
) -> GeodesicRays:
    """Thin crowded rays, fill gaps and enter faces that were left behind."""
    if len(rays):
        snapshot = FrontSnapshot(frames, rays, distance)
        measure_growth(rays, snapshot, STRIDE)
        rays = fill_gaps(frames, tentative, *thin(rays, snapshot), distance)
    return _joined(frames, tentative, rays, unswept.rays_into(frames, tentative, distance), distance)


def _joined(
    frames: Unfolding, tentative: TentativeDistances, rays: GeodesicRays, new: GeodesicRays, distance: float
) -> GeodesicRays:
    """The rays, and new ones that are brought up to them."""
    if len(new) == 0:
        return rays
    advance(frames, tentative, new, distance)
    new = new.without(new.stopped())
    new.links.after = np.where(new.links.after >= 0, new.links.after + len(rays), -1)
    return rays.joined(new)
