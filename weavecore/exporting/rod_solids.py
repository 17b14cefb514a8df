"""The rods of a weave as solid pipes, for the mesh files."""

from __future__ import annotations

import numpy as np

from weavecore.exporting.polygons import Polygons, polygons_of
from weavecore.exporting.product import Product
from weavecore.geometry.arrays import Floats
from weavecore.geometry.pipes import pipe_mesh
from weavecore.geometry.splines import CurveSamples
from weavecore.model import Weave

_STEPS_PER_DIAMETER = 1.0


def faces_to_write(product: Product, ending: str) -> Polygons:
    """The rods of a weave as pipes; otherwise the faces of `polygons_of`."""
    return polygons_of(product, ending) if product.weave is None else rod_polygons(product.weave)


def rod_polygons(weave: Weave) -> Polygons:
    """All rods as solid pipes."""
    samples = weave.axes.samples(_STEPS_PER_DIAMETER * weave.rod_diameter)
    normals = _normals_along(weave, samples)
    return Polygons(*pipe_mesh(samples, weave.strands.closed, normals, weave.rod_diameter / 2.0))


def _normals_along(weave: Weave, samples: CurveSamples) -> Floats:
    """Normals of the nodes (N, 3), carried along the rods by linear interpolation."""
    given = np.flatnonzero(samples.is_given)
    last = samples.offsets[1:] - 1
    closed = weave.strands.closed
    # The sample at the end of a closed rod is its first visit once more.
    ends = last[closed]
    firsts = weave.strands.offsets[:-1][closed]
    place = np.concatenate([given, ends])
    normal = np.concatenate([weave.normals[weave.strands.nodes], weave.normals[weave.strands.nodes[firsts]]])
    order = np.argsort(place, kind="stable")
    at = np.arange(samples.offsets[-1])
    columns = [np.interp(at, place[order], normal[order, k]) for k in range(3)]
    normals: Floats = np.stack(columns, axis=1)
    return normals
