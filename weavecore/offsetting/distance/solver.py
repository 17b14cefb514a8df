"""The distance from the borders, exact but for what the spacing of rays leaves.

Rays run from the borders over the whole surface (`rays`), the front is kept whole as they
spread and meet (`front`), and what they found at the vertices is settled (`settling`).
Work grows linearly with the faces: each face is crossed by a fixed number of rays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np

from weavecore.geometry.arrays import Floats, frozen
from weavecore.geometry.geodesics import Unfolding
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.front import Lag, Look, fill_gaps, measure_growth, thin
from weavecore.offsetting.distance.ray_seeds import seed_rays
from weavecore.offsetting.distance.rays import Rays, Records, advance, offer_start
from weavecore.offsetting.distance.reflected_double import Saddles, glue_mirror, part_sheets
from weavecore.offsetting.distance.relaxation import settle

Progress = Optional[Callable[[float, str], None]]

STRIDE = 3.0  # median edge lengths between two looks at the front


def measure_distance(surface: SurfaceMesh, *, progress: Progress = None) -> DistanceField:
    """Measure the distance from the origins along the surface.

    Parameters
    ----------
    surface : SurfaceMesh
        Each component has an origin.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    DistanceField
        Distance and direction at every vertex, in the model's unit.

    Notes
    -----
    Straightest geodesics as in Yan et al. 2016, §4.2, traced all at once; whichever comes
    first wins, which settles self- and mutual intersections (§4.3, §4.4) without looking for them.
    """
    frames, scale = _frames_of(surface)
    records = _march(frames, surface, progress)
    gradient = settle(frames, records)
    n = surface.n_vertices
    return DistanceField(records.distance[:n] * scale, gradient[:n])


def _frames_of(surface: SurfaceMesh) -> tuple[Unfolding, float]:
    """Frames of the mesh, and of its mirror if there are selvedges, about 0 in units of its median edge length."""
    centred = surface.vertices - surface.vertices.mean(axis=0)
    scale = float(np.median(surface.edge_lengths)) or 1.0
    if surface.is_selvedge.any():
        vertex, faces, twins = glue_mirror(surface)
        return Unfolding(centred[vertex] / scale, faces, twins), scale
    twins = np.where(surface.is_cut, NO_TWIN, surface.twins)
    return Unfolding(centred / scale, surface.faces, twins), scale


def _march(frames: Unfolding, surface: SurfaceMesh, progress: Progress) -> Records:
    records = Records(frames, np.flatnonzero(frames.on_wall))
    lag, saddles = Lag(frames), Saddles(frames, surface)
    rays = seed_rays(frames)
    part_sheets(rays, surface)
    with np.errstate(all="ignore"):
        rays.gap = Look(frames, rays, 0.0).gap + 1e-12
        offer_start(frames, records, rays)
        distance = 0.0
        while len(rays) or not lag.is_over:
            distance += STRIDE
            advance(frames, records, rays, distance)
            rays = rays.without(np.isinf(rays.distance))
            rays = _joined(frames, records, rays, saddles.fan_out(frames, records, distance), distance)
            part_sheets(rays, surface)
            rays = _mend(frames, records, rays, distance, lag)
            if progress is not None:
                progress(float(np.isfinite(records.distance).mean()), "offsetting the borders")
            reached = records.distance[np.isfinite(records.distance)].max()
            if distance > reached + STRIDE + (0.0 if lag.is_over else 2 * frames.length.max()):
                break
    return records


def _mend(frames: Unfolding, records: Records, rays: Rays, distance: float, lag: Lag) -> Rays:
    if len(rays):
        look = Look(frames, rays, distance)
        measure_growth(rays, look, STRIDE)
        rays = fill_gaps(frames, records, thin(rays, look), distance)
    return _joined(frames, records, rays, lag.take_up(frames, records, distance), distance)


def _joined(frames: Unfolding, records: Records, rays: Rays, more: Rays, distance: float) -> Rays:
    """The rays, and new ones that are brought up to them."""
    if len(more) == 0:
        return rays
    advance(frames, records, more, distance)
    more = more.without(np.isinf(more.distance))
    more.after = np.where(more.after >= 0, more.after + len(rays), -1)
    return rays.joined(more)


# ----------------------------------------------------------------------
# `DistanceField`: the distance from the borders, at the vertices.


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distance from the borders and cuts along the surface.

    Parameters
    ----------
    distance : (V,) float64
        In the model's unit; 0 on borders and cuts.
    gradient : (V, 3) float64
        Direction in which the shortest path arrives at each vertex: a unit vector tangent
        to a face there, pointing away from the borders.  Zero where there is none: on the
        borders and cuts, and where the direction is not known.
    """

    distance: Floats
    gradient: Floats

    def __post_init__(self) -> None:
        n = len(self.distance)
        object.__setattr__(self, "distance", frozen(self.distance, np.float64, (n,)))
        object.__setattr__(self, "gradient", frozen(self.gradient, np.float64, (n, 3)))
