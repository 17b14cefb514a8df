"""Surfaces for the tests of linking, and a checker of lattices.

The checker shares no code with the project's own, so that neither hides the other's faults.
"""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np

from planar_meshes import circle, plate, rectangle
from weavecore.linking.link import link_latitudes
from weavecore.model import Lattice, SurfaceMesh
from weavecore.offsetting.level_sets import offset_levels


def revolved(profile, columns, *, top=False, bottom=False):
    """Turn points (radius, height), from the bottom up, about the z axis; outside is away from it.

    ``top`` and ``bottom`` close the ends with a vertex on the axis at the given height.
    """
    profile = np.asarray(profile, float)
    turn = 2 * np.pi * np.arange(columns) / columns
    vertices = [np.stack([r * np.cos(turn), r * np.sin(turn), np.full(columns, z)], axis=1) for r, z in profile]
    j, k = np.arange(columns), (np.arange(columns) + 1) % columns
    faces = []
    for row in range(len(profile) - 1):
        a, b = row * columns + j, row * columns + k
        faces += [np.stack([a, b, b + columns], 1), np.stack([a, b + columns, a + columns], 1)]
    last = (len(profile) - 1) * columns
    n = len(profile) * columns
    if top is not False:
        vertices.append([[0.0, 0.0, top]])
        faces.append(np.stack([last + j, last + k, np.full(columns, n)], 1))
        n += 1
    if bottom is not False:
        vertices.append([[0.0, 0.0, bottom]])
        faces.append(np.stack([k, j, np.full(columns, n)], 1))
    return np.concatenate(vertices), np.concatenate(faces)


def hemisphere(rows=24, columns=64):
    angle = np.linspace(0.0, np.pi / 2, rows + 1)[:-1]
    return revolved(np.stack([np.cos(angle), np.sin(angle)], 1), columns, top=1.0)


def cylinder(height=4.0, radius=1.0, rows=40, columns=48):
    return revolved(np.stack([np.full(rows + 1, radius), np.linspace(0, height, rows + 1)], 1), columns)


def cone_frustum(rows=30, columns=60):
    return revolved(np.stack([np.linspace(2.0, 0.5, rows + 1), np.linspace(0, 2, rows + 1)], 1), columns)


def sphere(rows=40, columns=60):
    """A closed sphere, and the vertices of its equator."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)[1:-1]
    mesh = revolved(np.stack([np.cos(angle), np.sin(angle)], 1), columns, top=1.0, bottom=-1.0)
    return mesh, (rows // 2 - 1) * columns + np.arange(columns)


def torus(around=56, along=36, radius=2.0, tube=0.8):
    """A closed torus; vertex ``i * around + j`` has the tube's angle ``i`` and the ring's angle ``j``."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(along) / along)
    r = radius + tube * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), tube * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = (i + 1) % along * around + j, (i + 1) % along * around + (j + 1) % around
    return vertices, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def holed_torus():
    """A torus with a round hole: one border and a handle."""
    vertices, faces = torus()
    return kept(vertices, faces, np.linalg.norm(vertices[faces].mean(1) - [2.8, 0, 0], axis=1) > 0.5)


def pair_of_pants():
    return plate([circle(2.0, n=120), circle(0.4, (-0.9, 0), 30)[::-1], circle(0.4, (0.9, 0), 30)[::-1]], 0.08)


def dumbbell():
    """Two discs joined by a neck that the second level cannot pass."""
    x = np.linspace(-2.0, 2.0, 81)
    upper = 0.28 + 0.55 * np.exp(-((np.abs(x) - 1.35) ** 2) / 0.25)
    ends = np.array([[2.15, 0.3], [2.2, 0.0], [2.15, -0.3]])
    outline = np.concatenate([np.c_[x, -upper], ends[::-1], np.c_[x, upper][::-1], ends * [-1, 1]])
    return plate([outline], 0.07)


def thin_fold(gap=0.06, length=2.0, width=3.0, edge=0.06):
    """A strip bent back on itself: two sheets that are much nearer to each other than rings are."""
    vertices, faces = plate([rectangle(2 * length, width)], edge)
    s, half = vertices[:, 0], gap / 2
    turn = np.clip(s / half, -np.pi / 2, np.pi / 2)
    straight = np.maximum(np.abs(s) - np.pi / 2 * half, 0.0)
    return np.stack([straight - half * np.cos(turn), vertices[:, 1], half * np.sin(turn)], 1), faces


def kept(vertices, faces, flag):
    used, numbered = np.unique(faces[flag], return_inverse=True)
    return vertices[used], numbered.reshape(-1, 3)


def linked(mesh, spacing, *, cuts=(), **options) -> Lattice:
    """The lattice of a mesh (vertices, faces), checked."""
    lattice = link_latitudes(offset_levels(SurfaceMesh(*mesh, cuts=cuts), spacing=spacing), **options)
    check_weave(lattice)
    return lattice


def check_weave(lattice: Lattice) -> None:
    """Fail unless the lattice is a manifold like the surface, oriented, with its edges in families that fit."""
    offsets, corners = lattice.face_offsets, lattice.face_nodes
    polygons = [corners[a:b].tolist() for a, b in zip(offsets[:-1], offsets[1:])]
    directed = Counter((p[i - 1], p[i]) for p in polygons for i in range(len(p)))
    assert max(directed.values()) == 1, "two faces run the same way along an edge"
    assert all(len(set(p)) == len(p) >= 3 for p in polygons)
    undirected = {tuple(sorted(e)) for e in directed}
    assert sorted(undirected) == [tuple(e) for e in lattice.edges.tolist()]
    assert len({v for p in polygons for v in p}) == lattice.n_nodes
    surface = lattice.latitudes.surface
    assert lattice.n_nodes - len(undirected) + len(polygons) == surface.euler_characteristic
    naked = [e for e in directed if e[::-1] not in directed]
    after = dict(naked)
    assert len(after) == len(naked), "a node lies on the border twice"
    assert _loops(after) == len(surface.borders)
    assert _fans_at_nodes(polygons, lattice.n_nodes), "a node is pinched"
    _check_families(lattice, {tuple(sorted(e)) for e in naked})
    assert lattice.edge_lengths.min() > 1e-3 * lattice.latitudes.spacing


def _loops(after):
    count, after = 0, dict(after)
    while after:
        count += 1
        v = next(iter(after))
        while v in after:
            v = after.pop(v)
    return count


def _fans_at_nodes(polygons, n):
    spokes = defaultdict(list)
    for p in polygons:
        for i, v in enumerate(p):
            spokes[v].append((p[i - 1], p[(i + 1) % len(p)]))
    for pairs in spokes.values():
        group = {x: x for pair in pairs for x in pair}

        def root(x, group=group):
            while group[x] != x:
                x = group[x]
            return x

        for a, b in pairs:
            group[root(a)] = root(b)
        if len({root(x) for x in group}) != 1:
            return False
    return len(spokes) == n


def _check_families(lattice: Lattice, naked) -> None:
    rings = defaultdict(list)
    parents = {tuple(p) for p in lattice.latitudes.parents.tolist()}
    for (a, b), family in zip(lattice.edges.tolist(), lattice.edge_family.tolist()):
        p, q = lattice.node_latitude[a], lattice.node_latitude[b]
        if family == 0:
            assert p == q >= 0
            rings[p].append((a, b))
        elif family == 1:
            on_selvedge = -1 in (p, q) or (a, b) in naked
            assert (p, q) in parents or (q, p) in parents or on_selvedge
    assert sorted(rings) == np.unique(lattice.node_latitude[lattice.node_latitude >= 0]).tolist()
    for p, edges in rings.items():
        ends = Counter(v for e in edges for v in e)
        n_nodes = int(np.sum(lattice.node_latitude == p))
        if lattice.latitudes.polylines.closed[p]:
            assert set(ends.values()) == {2}
            assert len(edges) == n_nodes >= 3
        else:
            assert sorted(ends.values())[:3] in ([1, 1], [1, 1, 2])
            assert len(edges) == n_nodes - 1 >= 1
