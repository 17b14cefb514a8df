"""A catalogue of surfaces that are hard to offset and link, each made from a seed.

``TOUGH[name](seed)`` gives (vertices (V, 3), faces (F, 3)): manifold, oriented, in about a
thousand faces.  The seed varies what is said in the name's function; seed 0 is one of them.
"""

from __future__ import annotations

import numpy as np

from tough_plates import comb, hole_near_the_rim, neck, plate_with_holes, slits, star
from tough_register import TOUGH, joined, tough
from tough_tubes import fan, hourglass

__all__ = ["TOUGH"]


@tough
def pieces(rng):
    """Several surfaces beside, through and inside each other; none shares a vertex with another."""
    parts = [hourglass(int(rng.integers(9))), fan(int(rng.integers(9))), plate_with_holes(int(rng.integers(9)))]
    return joined(*[(v + rng.uniform(-1, 1, 3), f) for v, f in parts])


@tough
def far_away(rng):
    """Ten thousand to ten million times its size from the origin."""
    vertices, faces = hole_near_the_rim(3)
    return vertices + rng.normal(size=3) * 10 ** rng.uniform(4, 7), faces


@tough
def any_scale(rng):
    """From a billionth to a billion."""
    vertices, faces = plate_with_holes(int(rng.integers(9)))
    return vertices * 10 ** rng.uniform(-9, 9), faces


@tough
def renumbered(rng):
    """Vertices and faces in any order, corners turned."""
    vertices, faces = star(int(rng.integers(9)))
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    turned = np.array([np.roll(face, k) for face, k in zip(place[faces], rng.integers(3, size=len(faces)))])
    return vertices[order], turned[rng.permutation(len(turned))]


@tough
def crumpled(rng):
    """Any of the plates with every vertex moved a little out of place."""
    vertices, faces = [neck, star, comb, slits][int(rng.integers(4))](int(rng.integers(9)))
    a, b = vertices[faces[:, 0]], vertices[faces[:, 1]]
    edge = np.median(np.linalg.norm(a - b, axis=1))
    moved = vertices.copy()
    moved[:, 2] += rng.normal(0, 0.3 * edge, len(vertices))
    return moved, faces
