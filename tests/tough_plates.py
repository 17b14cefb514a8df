"""Tough surfaces that are plates, flat or curved: necks, holes, slits, corners, rough heights."""

from __future__ import annotations

import numpy as np

from planar_meshes import circle, plate, rectangle
from tough_register import curved, sheet, tough


@tough
def neck(rng):
    """Two lobes joined by a neck, from a third of their width down to a thousandth."""
    width = 10 ** rng.uniform(-3, -0.5)
    left, right = circle(1.0, (-1.4, 0), 40), circle(rng.uniform(0.4, 1.0), (1.4, 0), 32)
    left = left[np.abs(np.arctan2(left[:, 1], left[:, 0] + 1.4)) > 0.2]
    right = right[np.abs(np.arctan2(right[:, 1], 1.4 - right[:, 0])) > 0.2]
    order = np.argsort(np.arctan2(left[:, 1], left[:, 0] + 1.4) % (2 * np.pi))
    low_neck, high_neck = [[-0.3, -width / 2], [0.3, -width / 2]], [[0.3, width / 2], [-0.3, width / 2]]
    after = np.argsort((np.arctan2(right[:, 1], right[:, 0] - 1.4) + np.pi) % (2 * np.pi))
    outline = np.concatenate([left[order], low_neck, right[after], high_neck])
    return curved(plate([outline], 0.12, 0.1, rng), rng)


@tough
def plate_with_holes(rng):
    """A plate with one to nine round or square holes in a row or scattered."""
    n = int(rng.integers(1, 10))
    cells = rng.permutation(16)[:n]
    holes = []
    for cell in cells:
        centre = np.array([cell % 4 - 1.5, cell // 4 - 1.5]) + rng.uniform(-0.05, 0.05, 2)
        radius = rng.uniform(0.05, 0.42)
        holes.append(circle(radius, centre, 20) if rng.random() < 0.6 else rectangle(radius, 1.2 * radius, centre))
    return curved(plate([rectangle(4.2, 4.2), *holes], 0.16, 0.1, rng), rng, 0.15)


@tough
def hole_near_the_rim(rng):
    """A disc with a hole that comes within 1e-4 to 1e-1 of its rim."""
    gap = 10 ** rng.uniform(-4, -1)
    radius = rng.uniform(0.15, 0.7)
    return plate([circle(1.0, n=96), circle(radius, (1 - radius - gap, 0), 72)], 0.08, 0.1, rng)


@tough
def slits(rng):
    """A plate with slits, a thousandth of its size wide."""
    n, width = int(rng.integers(1, 5)), 10 ** rng.uniform(-3.3, -2)
    slots = [rectangle(rng.uniform(0.5, 1.6), width, (0.0, y)) for y in np.linspace(-0.7, 0.7, n + 2)[1:-1]]
    return curved(plate([rectangle(2, 2), *slots], 0.09, 0.1, rng), rng, 0.1)


@tough
def star(rng):
    """A star with sharp corners, inwards and outwards."""
    n = int(rng.integers(3, 12))
    radius = np.where(np.arange(2 * n) % 2, rng.uniform(0.1, 0.8), 1.0)
    return curved(plate([circle(1.0, n=2 * n) * radius[:, None]], 0.07, 0.1, rng), rng, 0.2)


@tough
def comb(rng):
    """Thin fins on a beam."""
    n, length = int(rng.integers(2, 8)), rng.uniform(0.3, 1.5)
    width = rng.uniform(0.02, 0.4) / n
    corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.25]]
    for x in np.linspace(1, 0, n + 2)[1:-1]:
        corners += [
            [x + width, 0.25],
            [x + width / 2, 0.25 + length],
            [x - width / 2, 0.25 + length],
            [x - width, 0.25],
        ]
    return plate([np.array([*corners, [0.0, 0.25]])], 0.05, 0.1, rng)


@tough
def tiny_holes(rng):
    """A disc with holes a thousandth of its size, each three or four edges around."""
    holes = [circle(10 ** rng.uniform(-4, -2), rng.uniform(-0.5, 0.5, 2), int(rng.integers(3, 5))) for _ in range(3)]
    return curved(plate([circle(1.0), *holes], 0.08, 0.1, rng), rng)


@tough
def missing_faces(rng):
    """A disc with single faces taken out, apart from each other and from the rim."""
    vertices, faces = plate([circle(1.0)], 0.08, 0.1, rng)
    centres = vertices[faces].mean(1)
    gone = []
    for face in rng.permutation(np.flatnonzero(np.linalg.norm(centres, axis=1) < 0.75)):
        if all(np.linalg.norm(centres[face] - centres[other]) > 0.35 for other in gone):
            gone.append(face)
    return curved((vertices, np.delete(faces, gone[:4], axis=0)), rng)


@tough
def maze(rng):
    """Concentric walls with one gate each, as slots in a disc: long detours, fronts that meet at the far side."""
    walls, n = [], int(rng.integers(1, 5))
    for radius in np.linspace(0.25, 0.8, n):
        gate, thick = rng.uniform(0, 2 * np.pi), 0.01
        angle = gate + np.linspace(0.25, 2 * np.pi - 0.25, 60)
        around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        walls.append(np.concatenate([around * (radius + thick), around[::-1] * (radius - thick)]))
    return plate([circle(1.0, n=90), *walls], 0.05, 0.1, rng)


@tough
def square_with_ties(rng):
    """A regular grid: distances tie everywhere, levels pass through rows of vertices, fronts meet along diagonals."""
    n = 4 * int(rng.integers(3, 9))
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    vertices, faces = sheet(x, y, 0 * x)
    if rng.random() < 0.5:
        cell = vertices[faces].mean(1)[:, :2]
        faces = faces[(np.abs(cell - n / 2) > n / 4).any(1)]
        used, faces = np.unique(faces, return_inverse=True)
        vertices, faces = vertices[used], faces.reshape(-1, 3)
    return vertices, faces


@tough
def rough_terrain(rng):
    """A plate with heights of noise, up to as steep as an edge is long."""
    vertices, faces = plate([rectangle(2, 1.5)], 0.07, 0.2, rng)
    vertices[:, 2] = rng.normal(0, rng.uniform(0.005, 0.05), len(vertices))
    return vertices, faces


@tough
def uneven_density(rng):
    """A grid whose cells grow a thousandfold from corner to corner."""
    n = 28
    ticks = np.geomspace(1.0, 10 ** rng.uniform(1, 3), n)
    x, y = np.meshgrid(ticks, ticks if rng.random() < 0.5 else np.linspace(0, ticks[-1], n), indexing="ij")
    return sheet(x, y, 0.1 * ticks[-1] * np.sin(3 * x / ticks[-1]))


@tough
def graded_holes(rng):
    """Holes ever smaller, ever closer: a thousandfold change of scale in one surface."""
    ratio = rng.uniform(0.4, 0.7)
    x, radius, holes = 0.0, 0.3, []
    for _ in range(6):
        holes.append(circle(radius, (x, 0.0), 24))
        x += 1.25 * radius * (1 + ratio)
        radius *= ratio
    return plate([rectangle(4.0, 1.4, (0.9, 0.0)), *holes], 0.1, 0.1, rng)
