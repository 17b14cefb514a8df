"""Tough surfaces that are strips, tubes and closed bodies, and meshes of very few faces."""

from __future__ import annotations

import numpy as np

from implicit import implicit_surface, march, trim
from planar_meshes import circle
from shapes import smooth_least
from tough_register import grid, largest_piece, sheet, tough


@tough
def one_triangle(rng):
    """A single face of any shape."""
    return rng.normal(size=(3, 3)) * rng.uniform(0.2, 5, 3), np.array([[0, 1, 2]])


@tough
def two_triangles(rng):
    """Two faces on a common edge."""
    return rng.normal(size=(4, 3)), np.array([[0, 1, 2], [2, 1, 3]])


@tough
def strip(rng):
    """One face wide: no vertex inside."""
    n = int(rng.integers(2, 60))
    x, y = np.meshgrid(np.cumsum(rng.uniform(0.3, 1.0, n)), [0.0, 1.0], indexing="ij")
    return sheet(x, y + 0.3 * np.sin(x), 0.5 * np.cos(x / 2))


@tough
def ring_strip(rng):
    """A ring one face wide: two borders, no vertex inside."""
    n = int(rng.integers(3, 60))
    angle = 2 * np.pi * np.arange(n) / n
    low, high = np.zeros(n), np.full(n, rng.uniform(0.05, 2.0))
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.c_[around, low], np.c_[around, high]])
    k = np.arange(n)
    after = (k + 1) % n
    return points, np.concatenate([np.stack([k, after, n + after], 1), np.stack([k, n + after, n + k], 1)])


@tough
def spiral(rng):
    """A band wound up on itself, the turns close to each other."""
    turns, wide = rng.uniform(1.5, 4), rng.uniform(0.5, 0.98)
    angle = np.linspace(0, 2 * np.pi * turns, int(60 * turns))[:, None]
    radius = 1 + (angle / (2 * np.pi)) + wide * np.linspace(0, 1, 5)
    return sheet(radius * np.cos(angle), radius * np.sin(angle), 0.05 * radius)


@tough
def fan(rng):
    """A disc as render meshes have it: all faces meet in the middle."""
    n = int(rng.integers(3, 90))
    rim = np.c_[circle(1.0, n=n) * [rng.uniform(0.2, 1), 1], np.zeros(n)]
    k = np.arange(n)
    return np.concatenate([rim, [[0.0, 0.0, rng.uniform(-1, 1)]]]), np.stack([k, (k + 1) % n, np.full(n, n)], 1)


@tough
def long_faced_tube(rng):
    """A tube as render meshes have it: faces from end to end."""
    n, length = int(rng.integers(5, 40)), rng.uniform(2, 30)
    angle = 2 * np.pi * np.arange(n) / n
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.c_[around, np.zeros(n)], np.c_[around * rng.uniform(0.2, 1), np.full(n, length)]])
    k = np.arange(n)
    after = (k + 1) % n
    return points, np.concatenate([np.stack([k, after, n + after], 1), np.stack([k, n + after, n + k], 1)])


@tough
def box_with_a_hole(rng):
    """Twenty faces or so: a box open at the top with a hole in one side."""
    corners = np.array([[x, y, z] for z in (0.0, 1) for y in (0.0, 1) for x in (0.0, 1)])
    s, t = np.sort(rng.uniform(0.2, 0.8, 2))
    hole = np.array([[1.0, s, s], [1, t, s], [1, t, t], [1, s, t]])
    faces = [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2]]
    around = [1, 3, 7, 5]
    for k in range(4):
        a, b, c, d = around[k], around[(k + 1) % 4], 8 + k, 8 + (k + 1) % 4
        faces += [[a, b, d], [a, d, c]]
    return np.concatenate([corners, hole]) * rng.uniform(0.5, 3, 3), np.array(faces)


@tough
def cone(rng):
    """A cone to a sharp point, of rings of faces."""
    n, rows, steep = 36, 14, 10 ** rng.uniform(-0.5, 0.8)
    down = np.linspace(0, 1, rows)[1:, None]
    angle = 2 * np.pi * np.arange(n) / n
    x, y = down * np.cos(angle), down * np.sin(angle)
    points = np.stack([x, y, -steep * np.broadcast_to(down, x.shape)], -1).reshape(-1, 3)
    faces = grid(rows - 1, n, wrap_v=True)
    k = np.arange(n)
    cap = np.stack([np.full(n, len(points)), k, (k + 1) % n], 1)
    return np.concatenate([points, [[0.0, 0, 0]]]), np.concatenate([faces, cap])


@tough
def frill(rng):
    """A disc with far too much rim: waves that grow outwards."""
    waves, n, rows = int(rng.integers(3, 9)), 120, 16
    radius = np.linspace(0.15, 1, rows)[:, None]
    angle = 2 * np.pi * np.arange(n) / n
    z = rng.uniform(0.2, 0.6) * radius**2 * np.sin(waves * angle)
    return np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z), -1).reshape(-1, 3), grid(
        rows, n, wrap_v=True
    )


@tough
def helicoid(rng):
    """A ramp of several turns: far along the surface, near in space."""
    turns = rng.uniform(1, 5)
    angle = np.linspace(0, 2 * np.pi * turns, int(30 * turns))[:, None]
    radius = np.linspace(0.2, 1, 9)
    return sheet(radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0.05, 0.4) * angle / np.pi)


@tough
def hourglass(rng):
    """Two borders that meet head-on, at equal distance all around."""
    n, rows, waist = 48, 2 * int(rng.integers(6, 16)) + 1, 10 ** rng.uniform(-2, 0)
    z = np.linspace(-1, 1, rows)[:, None]
    angle = 2 * np.pi * np.arange(n) / n
    radius = np.hypot(waist, z)
    points = np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z), -1).reshape(-1, 3)
    return points, grid(rows, n, wrap_v=True)[:, ::-1]


@tough
def pinched_tube(rng):
    """A flattened tube whose sides all but touch in space."""
    n, rows, flat = 60, 30, 10 ** rng.uniform(-3, -1)
    z = np.linspace(-1, 1, rows)[:, None]
    angle = 2 * np.pi * np.arange(n) / n
    depth = flat + (1 - flat) * np.abs(z) ** 1.5
    points = np.stack(np.broadcast_arrays(np.cos(angle), depth * np.sin(angle), 2 * z), -1).reshape(-1, 3)
    return points, grid(rows, n, wrap_v=True)[:, ::-1]


@tough
def joint(rng):
    """Three to seven round arms in any directions."""
    arms, wanted = [], int(rng.integers(3, 8))
    for _ in range(200):
        arm = rng.normal(size=3)
        arm /= np.linalg.norm(arm)
        if all(arm @ other < 0.3 for other in arms):
            arms.append(arm)
    arms = np.array(arms[:wanted])

    def body(p):
        along = np.maximum(p @ arms.T, 0.0)
        fields = [np.linalg.norm(p - s[:, None] * arm, axis=1) - 0.32 for s, arm in zip(along.T, arms)]
        return smooth_least(fields, 0.07)

    return implicit_surface(body, lambda p: (p @ arms.T).max(1) - 1.3, (-1.7,) * 3, (1.7,) * 3, 0.13, 3)


@tough
def handles(rng):
    """One to four rings run together, with a round hole: that genus, one border."""
    n = int(rng.integers(1, 5))

    def body(p):
        rings = []
        for k in range(n):
            x = p[:, 0] - 1.7 * k
            rings.append(np.hypot(np.hypot(x, p[:, 1]) - 0.75, p[:, 2]) - 0.27)
        return smooth_least(rings, 0.06)

    hole = lambda p: 0.3 - np.linalg.norm(p - [-0.85, 0.0, 0.0], axis=1)  # noqa: E731
    return implicit_surface(body, hole, (-1.3, -1.3, -0.5), (1.7 * n - 0.4, 1.3, 0.5), 0.13, 3)


@tough
def raw_march(rng):
    """Marching tetrahedra, trimmed and left as they are: slivers and specks of faces everywhere."""
    a, b, c = rng.uniform(0.6, 1.2, 3)
    shift = rng.uniform(-np.pi, np.pi, 3)

    def field(p):
        x, y, z = (p * 2.2 + shift).T
        return a * np.sin(x) * np.cos(y) + b * np.sin(y) * np.cos(z) + c * np.sin(z) * np.cos(x)

    vertices, faces = march(field, (-1.3,) * 3, (1.3,) * 3, 0.16)
    return largest_piece(*trim(vertices, faces, np.linalg.norm(vertices, axis=1) - 1.2))


@tough
def closed_bodies(rng):
    """Closed: a tetrahedron, a box, or a lumpy ball."""
    kind = int(rng.integers(3))
    if kind == 0:
        return rng.normal(size=(1, 3)) + np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array(
            [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
        )
    if kind == 1:
        corners = np.array([[x, y, z] for z in (0.0, 1) for y in (0.0, 1) for x in (0.0, 1)]) * rng.uniform(0.3, 3, 3)
        quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        return corners, np.array([[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)])
    lumps = rng.normal(size=(4, 3)) * 0.5
    body = lambda p: smooth_least([np.linalg.norm(p - lump, axis=1) - 0.5 for lump in lumps], 0.1)  # noqa: E731
    low, high = lumps.min(0) - 1, lumps.max(0) + 1
    vertices, faces = implicit_surface(body, None, tuple(low), tuple(high), 0.16, 3)
    return largest_piece(vertices, faces)


@tough
def closed_ring(rng):
    """A closed torus, as a grid."""
    n, m, thin = 60, 24, rng.uniform(0.1, 0.6)
    u, v = (2 * np.pi * np.arange(n) / n)[:, None], 2 * np.pi * np.arange(m) / m
    x, y, z = (1 + thin * np.cos(v)) * np.cos(u), (1 + thin * np.cos(v)) * np.sin(u), thin * np.sin(v)
    return np.stack(np.broadcast_arrays(x, y, z), -1).reshape(-1, 3), grid(n, m, True, True)
