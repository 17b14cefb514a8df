"""How thick a surface is: the distance to its opposite side, where it is a thin solid, a narrow tube or a fold.

Points are spread over the surface.  The thickness at a point p with normal n is the least height |n · (q - p)| of a
point q whose normal is opposed and which lies above or below p::

        ─────q──↑──────        n · n_q < -0.5
             |                 sideways no further than the points are apart, or half the height
        ─────p──↓──────

The opposite side may be a piece of its own that faces the same way, n · n_q > 0.9: a shell without a rim, whose inner
side was turned to face outwards, as closed pieces are.  There it must lie above or below rather than beside.

Rods on two sides that are nearer than the spacing clash, and rings cannot turn in a tube that is no wider.  k-d tree:
O(n log n) in the points, whose number is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model import Note, SurfaceMesh
from weavecore.model.notes import at
from weavecore.polling import each
from weavecore.reading.pieces import with_faces
from weavecore.reading.raw import counted

_POINTS = 60_000
"""Most points that are spread; on a surface of 60,000 squared spacings they are a spacing apart."""

_ASKED = 3_000
"""Points at which the thickness is measured: a share of a thousandth is still three points."""

_FINE = 8.0
"""Points in a spacing, where their number allows it."""

_OPPOSED = -0.5
"""Greatest cosine between normals of two sides."""

_ALIKE = 0.9
"""Least cosine between normals of two pieces, one above the other."""

_BESIDE = 2.0
"""Of the height: how far sideways a point of such a piece may lie; more is a piece beside it, at an angle below 25°."""

_ASLANT = 0.5
"""Of the height: how far sideways a point may lie."""

_SHARE = 0.01
"""Of the surface: less is the tip of a cone or a sharp edge, which is thin whatever the spacing."""

_SHARP = 0.1
"""Of the thin points: those at the sharp end of a fold or a tip, where no spacing would do."""

_SOLID = 0.5
"""Of the surface: where more is thin it is the solid of a sheet, not a narrow place."""

_RIM = np.cos(np.radians(50.0))
"""Cosine of the angle at the edges where the rim of a thin solid begins."""

_SEED = 1
"""Of the points' places, so that the same surface gives the same notes."""


@dataclass(frozen=True, eq=False)
class Thickness:
    """Thickness at points of a surface.

    Parameters
    ----------
    points : (n, 3) float64
    thickness : (n,) float64
        Infinite where there is no opposite side within reach.
    """

    points: Floats
    thickness: Floats


def measure_thickness(surface: SurfaceMesh, reach: float) -> Thickness:
    """Measure the thickness of a surface where it is less than a length.

    Parameters
    ----------
    surface : SurfaceMesh
    reach : float

    Returns
    -------
    Thickness
    """
    from scipy.spatial import cKDTree

    area, total = surface.face_areas, surface.area
    n = int(np.clip(total * (_FINE / reach) ** 2, _ASKED, _POINTS))
    rng = np.random.default_rng(_SEED)
    face = np.searchsorted(np.cumsum(area), (np.arange(n) + rng.random(n)) / n * total).clip(max=len(area) - 1)
    u, v = rng.random((2, n))
    root = np.sqrt(u)
    weight = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    points = np.einsum("nk,nkx->nx", weight, surface.vertices[surface.faces[face]])
    normals, piece = surface.face_normals[face], surface.component_of_face[face]
    apart = 1.5 * np.sqrt(total / n)  # Random points leave gaps somewhat wider than a regular grid.
    asked = np.arange(0, n, max(1, n // _ASKED))
    thickness = np.full(len(asked), np.inf)
    tree = cKDTree(points)
    for start in each(range(0, len(asked), 500)):  # bounds the memory of the candidates
        block = asked[start : start + 500]
        near = cKDTree(points[block]).sparse_distance_matrix(tree, reach + apart, output_type="ndarray")
        row, other = near["i"], near["j"]
        cosine = np.einsum("ij,ij->i", normals[other], normals[block[row]])
        is_alike = (cosine > _ALIKE) & (piece[other] != piece[block[row]])
        may_be = np.flatnonzero((cosine < _OPPOSED) | is_alike)
        row, other, is_alike = row[may_be], other[may_be], is_alike[may_be]
        to = points[other] - points[block[row]]
        height = np.abs(np.einsum("ij,ij->i", to, normals[block[row]]))
        aside = np.sqrt(np.maximum(np.einsum("ij,ij->i", to, to) - height**2, 0))
        hit = ~is_alike | (aside <= _BESIDE * height)
        hit &= (height < reach) & (aside <= np.maximum(apart, _ASLANT * height))
        np.minimum.at(thickness, start + row[hit], height[hit])
    return Thickness(points[asked], thickness)


def note_thickness(surface: SurfaceMesh, spacing: float) -> SurfaceMesh:
    """Note where a surface is thinner than a spacing.

    Parameters
    ----------
    surface : SurfaceMesh
    spacing : float
        The least, where there are several.

    Returns
    -------
    SurfaceMesh
        With the note THIN where most of it is, or COARSE where part of it is.
    """
    found = measure_thickness(surface, spacing)
    thin = np.flatnonzero(found.thickness < spacing)
    share = len(thin) / len(found.thickness)
    if share < _SHARE:
        return surface
    order = thin[np.argsort(found.thickness[thin], kind="stable")]
    places, median = found.points[order], float(np.median(found.thickness[thin]))
    least = float(found.thickness[order[0]])
    numbers = {"share": share, "least": least, "median": median, "spacing": spacing}
    if share > _SOLID and _has_two_sides(surface):
        text = f"The surface is a solid about {median:.3g} thick, less than the spacing of {spacing:.3g}, as at "
        text += f"{at(places[0])}: both sides are woven, and their rods clash. --side outer takes the outer side alone."
        note = Note("THIN", text, numbers, places)
    else:
        would_do = float(np.quantile(found.thickness[thin], _SHARP))
        text = f"The spacing of {spacing:.3g} is wider than {share:.0%} of the surface is thick or its tubes and folds "
        text += f"are wide, least {least:.3g} at {at(places[0])}: {would_do:.2g} would do for 90% of these."
        note = Note("COARSE", text, {**numbers, "spacing_that_would_do": would_do}, places)
    others = (one for one in surface.notes if one.code not in ("THIN", "COARSE"))
    return surface.with_notes((*others, note))


def keep_outer_side(surface: SurfaceMesh) -> SurfaceMesh:
    """The outer side of a thin solid: the largest part between sharp edges.

    Parameters
    ----------
    surface : SurfaceMesh
        A thin solid, whose sides meet the rim at sharp edges, or are two pieces.

    Returns
    -------
    SurfaceMesh
        With the note LEFT_OUT.

    Raises
    ------
    Degenerate
        Where it has no two sides of like area.
    """
    part = _parts_between_edges(surface)
    area = np.bincount(part, surface.face_areas)
    order = np.argsort(-area, kind="stable")
    if len(order) < 2 or not _are_two_sides(area[order]):
        raise Degenerate(
            "The surface has no outer side: it is not a thin solid with sharp edges at its rim",
            remedy="Delete the inner side and the rim in the program that made it.",
        )
    keep: Bools = part == order[0]
    n = int((~keep).sum())
    text = f"Left out {counted(n, 'face')} of the inner side and the rim: only the outer side was asked for."
    where = surface.vertices[surface.faces[~keep]].mean(1)
    return with_faces(surface, surface.faces[keep], Note("LEFT_OUT", text, {"faces": n}, where))


def _has_two_sides(surface: SurfaceMesh) -> bool:
    area = np.bincount(_parts_between_edges(surface), surface.face_areas)
    return len(area) > 1 and _are_two_sides(np.sort(area)[::-1])


def _are_two_sides(area: NDArray[Any]) -> bool:
    """Whether the two largest parts are alike, and make most of the surface."""
    first, second = area[:2]
    return bool(second > 0.5 * first and first + second > 0.6 * area.sum())


def _parts_between_edges(surface: SurfaceMesh) -> Ints:
    """Part (F,) of each face, where parts meet at sharp edges."""
    twins, normals = surface.twins, surface.face_normals
    h = np.flatnonzero(twins != NO_TWIN)
    smooth = np.einsum("ij,ij->i", normals[h // 3], normals[twins[h] // 3]) > _RIM
    h = h[smooth]
    return connected(h // 3, twins[h] // 3, surface.n_faces)[1]
