"""Whether vectors point against the normal of the face of a mesh that is nearest to a point.

Most places need no nearest face: where the normals of all faces around lie within a narrow cone, a vector near its axis
points against none of them.  Space is divided into cubes; each has the cone of the faces whose centroids lie in it or
in one of the 26 cubes around, which is where the nearest face of a point that lies near the mesh is.  The few vectors
for which the cone is too wide are compared with the nearest face itself.

Work: linear in the faces once for each size of the cubes, then the same for each point.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, dots, unit_vectors
from weavecore.geometry.closest import FaceFinder
from weavecore.geometry.elementary import angles_between, arctangents, sines_and_cosines
from weavecore.polling import each, poll

_MOST_CUBES = 2_000_000
_MARGIN = 1e-6
"""Radians by which a cone is widened, far more than rounding."""


@dataclass(frozen=True, eq=False)
class _Cones:
    """Cones of the cubes that hold faces.

    Parameters
    ----------
    least : (3,) float64
        Least corner of the cubes.
    size : float
    shape : (3,) int64
    number : (cubes,) int64
        Of each cube among those with faces, or -1.
    axis : (K, 3) float64
    angle : (K,) float64
        Radians; π where nothing is certain.
    """

    least: Floats
    size: float
    shape: Ints
    number: Ints
    axis: Floats
    angle: Floats


class NearestNormals:
    """Compares vectors with the normals of nearest faces.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    normals : (F, 3) float64
        Unit normals of the faces, 0 where a face has no area.
    finder : FaceFinder
        Of the same mesh.
    """

    def __init__(self, vertices: Floats, faces: Ints, normals: Floats, finder: FaceFinder) -> None:
        self._vertices, self._faces, self._normals, self._finder = vertices, faces, normals, finder
        self._cones: dict[int, _Cones] = {}
        self._radius = 0.0

    def are_against(self, points: Floats, vectors: Floats, near: Floats) -> Bools:
        """Whether vectors point against the normals of the nearest faces, or have no direction.

        Parameters
        ----------
        points, vectors : (n, 3) float64
        near : (n,) float64
            Distances within which the mesh is known to come to each point.

        Returns
        -------
        (n,) bool
        """
        against = np.zeros(len(points), bool)
        doubtful = np.flatnonzero(~self._are_along(points, vectors, near))
        if len(doubtful):
            face = self._finder.find(points[doubtful])[0]
            against[doubtful] = dots(self._normals[face], vectors[doubtful]) <= 0
        return against

    def _are_along(self, points: Floats, vectors: Floats, near: Floats) -> Bools:
        """Whether vectors certainly point the way of the nearest faces."""
        poll()
        if len(points) == 0:
            return np.zeros(0, bool)
        # Cubes for most of the points; those further from the mesh are looked up.
        cones = self._cones_of(int(np.frexp(np.sort(near)[9 * len(near) // 10])[1]))
        cube = np.floor((points - cones.least) / cones.size).astype(np.int64)
        inside = ((cube >= 0) & (cube < cones.shape)).all(1) & (near + self._radius < cones.size)
        number = np.full(len(points), -1)
        number[inside] = cones.number[np.ravel_multi_index(tuple(cube[inside].T), tuple(cones.shape))]
        cosine = dots(unit_vectors(vectors), cones.axis[number])
        # An angle to the axis below 90° less that of the cone.
        along: Bools = (
            (number >= 0) & (cones.angle[number] < np.pi / 2) & (cosine > sines_and_cosines(cones.angle[number])[0])
        )
        return along

    def _cones_of(self, power: int) -> _Cones:
        if power not in self._cones:
            self._cones[power] = self._make_cones(2.0**power)
        return self._cones[power]

    def _make_cones(self, near: float) -> _Cones:
        """The cones for points to which the mesh comes so near."""
        corners = self._vertices[self._faces]
        middle = corners.mean(1)
        self._radius = float(np.sqrt(max(dots(arm, arm).max() for arm in (corners[:, k] - middle for k in range(3)))))
        poll()
        least, extent = middle.min(0), np.ptp(middle, axis=0)
        size = max(near + self._radius * (1 + 1e-6), float(np.cbrt(extent.max() ** 3 / _MOST_CUBES)))
        least = least - size
        shape = (extent / size).astype(np.int64) + 3
        at = np.ravel_multi_index(tuple(((middle - least) / size).astype(np.int64).T), tuple(shape))
        number = np.full(int(shape.prod()), -1)
        number[at] = 0
        cubes = np.flatnonzero(number == 0)
        number[cubes] = np.arange(len(cubes))
        poll()
        axis, angle = _cones_around(number[at], self._normals, len(cubes))
        wide_axis, wide_angle = np.zeros_like(axis), np.zeros(len(cubes))
        steps = [
            int(np.ravel_multi_index(tuple(np.array(step) + 1), tuple(shape))) for step in product((-1, 0, 1), repeat=3)
        ]
        around = [number[cubes + step - steps[13]] for step in steps]
        for other in around:
            wide_axis += np.where((other >= 0)[:, None], axis[other], 0.0)
        wide_axis = unit_vectors(wide_axis)
        for other in each(around):
            apart = angles_between(wide_axis, axis[other]) + angle[other]
            wide_angle = np.maximum(wide_angle, np.where(other >= 0, apart, 0.0))
        return _Cones(least, size, shape, number, wide_axis, np.minimum(wide_angle + _MARGIN, np.pi))


def _cones_around(number: Ints, normals: Floats, n: int) -> tuple[Floats, Floats]:
    """Axis and angle of the normals of each of ``n`` groups; a face without a normal makes its group's the whole."""
    axis = unit_vectors(np.stack([np.bincount(number, column, n) for column in normals.T], axis=1))
    cosine = np.ones(n)
    np.minimum.at(cosine, number, dots(normals, axis[number]))
    cosine = np.clip(cosine, -1.0, 1.0)
    angle = arctangents(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
    angle[number[~normals.any(1)]] = np.pi
    return axis, angle
