r"""Spacings in phase: two fronts meet halfway between two latitudes, so that rods run on from one to the other.

Where two fronts meet head-on at the distance D from the origins, the last latitudes of both sides are 2 (D mod s) apart
at the spacing s::

    D = 5.5 s   ----5---- . ----5----        one spacing apart: an ordinary band, and every rod crosses it
    D = 5.1 s   ----5-.-5----                so near that one of them is dropped: its rods end
    D = 5.9 s   ----5------- . -------5----  nearly two spacings: rods end on the nodes that fill the pocket

A front meets another inside an edge whose ends both rise towards the other.  With the slopes of the distance at both
ends, times the edge's length, the depth there is ``D = d_a + rise · (d_b + fall − d_a) / (rise + fall)``, as for the
nodes on the cut locus (`isolines.cut_locus`).  Linear in the edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, blocks
from weavecore.geometry.halfedges import next_halfedge
from weavecore.model import Note, SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField

_HEAD_ON = -0.5
"""Cosine of the directions of two fronts below which they meet head-on.  Where they meet at a sharper angle the depth
changes along the line where they meet, and no spacing is in phase with it."""

_BEYOND = (0.25, 0.46, 0.56, 0.8)
"""Parts of a spacing beyond the last latitude between which fronts meet in phase, wholly between the middle two.
Chosen on tubes (Ø 600, triangular), of which most, but not those of every height, have no rod end inside there."""

_FEWEST_SPACINGS = 8.0
"""Length in spacings of the line where fronts meet, from which on it matters: a pole has one of less than 2."""

_REACH = 0.1
"""A spacing in phase is looked for within this part of the one that is suggested: about as far as that was rounded."""

_DIGITS = 3
"""Significant digits of a spacing in phase: at 15 generations one in the third moves the phase by a seventh at most."""

_ENOUGH, _GAIN = 0.5, 0.25
"""Shares in phase: a spacing that has the first stays, and one that gains less than the second is not worth an odd
number."""

_PER_DIGIT, _PER_LENGTH = 0.1, 0.5
"""What a third digit, and a change of the spacing by its whole length, cost beside a share in phase."""


@dataclass(frozen=True, eq=False)
class Meetings:
    """Where fronts meet head-on.

    Parameters
    ----------
    depth : (n,) float64
        Distance from the origins.
    length : (n,) float64
        Of the line along which they meet there.
    """

    depth: Floats
    length: Floats

    def matters(self, spacing: float) -> bool:
        """Whether fronts meet along more than a few spacings."""
        return float(self.length.sum()) > _FEWEST_SPACINGS * spacing

    def share_in_phase(self, spacing: float) -> float:
        """Part of the line where fronts meet at which they are in phase, from 0 to 1."""
        beyond = (self.depth / spacing) % 1.0
        in_phase = np.where(self.depth > spacing, np.interp(beyond, _BEYOND, (0.0, 1.0, 1.0, 0.0)), 0.0)
        return float(self.length @ in_phase / max(self.length.sum(), np.finfo(float).tiny))

    def best_spacing(self, spacing: float) -> float:
        """The spacing with the greatest share in phase near another; short numbers and the nearest are preferred."""
        step = 10.0 ** (np.floor(np.log10(spacing)) + 1 - _DIGITS)
        steps = np.arange(np.ceil((1 - _REACH) * spacing / step), np.floor((1 + _REACH) * spacing / step) + 1)
        shares = np.array([self.share_in_phase(k * step) for k in steps.tolist()])
        cost = _PER_DIGIT * (steps % 10 != 0) + _PER_LENGTH * np.abs(steps * step / spacing - 1)
        best = float(steps[np.argmax(shares - cost)])
        return float(f"{best * step:.{_DIGITS}g}")


def find_meetings(surface: SurfaceMesh, field: DistanceField) -> Meetings:
    """Find where fronts meet head-on.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Of its vertices.

    Returns
    -------
    Meetings
    """
    found = [_meetings_on(surface, field, k) for k in blocks(3 * surface.n_faces)]
    return Meetings(*(np.concatenate(parts) for parts in zip(*found)))


def _meetings_on(surface: SurfaceMesh, field: DistanceField, halfedges: slice) -> tuple[Floats, Floats]:
    """Depth and length where fronts meet on some of the halfedges that are the first of their edges."""
    h = np.arange(halfedges.start, halfedges.stop)
    h = h[surface.twins[halfedges] > h]
    corner = surface.faces.ravel()
    a, b = corner[h], corner[next_halfedge(h)]
    along = surface.vertices[b] - surface.vertices[a]
    rise = np.einsum("ij,ij->i", field.gradient[a], along)
    fall = -np.einsum("ij,ij->i", field.gradient[b], along)
    facing = np.einsum("ij,ij->i", field.gradient[a], field.gradient[b])
    meets = (rise > 0) & (fall > 0) & (facing < _HEAD_ON)
    h, a, b, rise, fall, along = (part[meets] for part in (h, a, b, rise, fall, along))
    depth = field.distance[a] + rise * (field.distance[b] + fall - field.distance[a]) / (rise + fall)
    # An edge has a third of the two faces beside it: a strip of this area about the edge, which the line crosses.
    areas = surface.face_areas[h // 3] + surface.face_areas[surface.twins[h] // 3]
    return depth, 2 / 3 * areas / np.linalg.norm(along, axis=1)


def spacing_in_phase(surface: SurfaceMesh, field: DistanceField, spacing: float) -> float:
    """A spacing near another at which fronts meet in phase.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Of its vertices.
    spacing : float
        In the model's unit.

    Returns
    -------
    float
        The spacing itself, where it is in phase, no other is much better, or fronts hardly meet.
    """
    meetings = find_meetings(surface, field)
    if not meetings.matters(spacing):
        return spacing
    share = meetings.share_in_phase(spacing)
    best = meetings.best_spacing(spacing)
    gains = share < _ENOUGH and meetings.share_in_phase(best) >= share + _GAIN
    return best if gains else spacing


def note_phase(surface: SurfaceMesh, field: DistanceField, spacing: float) -> SurfaceMesh:
    """Note that fronts do not meet in phase, with the nearest spacing at which they do.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Of its vertices.
    spacing : float
        In the model's unit.

    Returns
    -------
    SurfaceMesh
        With the note PHASE, or itself where `spacing_in_phase` has no better one.
    """
    better = spacing_in_phase(surface, field, spacing)
    if better == spacing:
        return surface
    text = f"Fronts meet out of phase at the spacing of {spacing:.4g}, so many rods end there in patterns with rings; "
    text += f"{better:g} would be in phase."
    others = (one for one in surface.notes if one.code != "PHASE")
    numbers = {"spacing": spacing, "spacing_in_phase": better}
    return surface.with_notes((*others, Note("PHASE", text, numbers)))
