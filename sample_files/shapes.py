"""The surfaces of sample_files/, as arrays; lengths in millimetres.

Each function takes the wanted edge length and gives (vertices (V, 3), faces (F, 3)), corners
counter-clockwise seen from outside (from above, for the open shells).
"""

from __future__ import annotations

import numpy as np

from implicit import implicit_surface
from minimal import make_minimal
from remesh import Array, Field, Index

Mesh = tuple[Array, Index]


def smooth_least(fields: list[Array], width: float) -> Array:
    """The least of several fields, rounded where two of them are within ``width`` of each other."""
    stack = np.stack(fields)
    least = stack.min(0)
    rounded: Array = least - width * np.log(np.exp((least - stack) / width).sum(0))
    return rounded


def height_field(height: Field) -> Field:
    """The surface z = height(x, y), as a field that rises upwards."""
    return lambda p: p[:, 2] - height(p)


def disc(x: float, y: float, radius: float) -> Field:
    """Distance from a vertical cylinder, negative inside."""
    return lambda p: np.hypot(p[:, 0] - x, p[:, 1] - y) - radius


def hemisphere(edge: float = 11.5) -> Mesh:
    """Half a sphere of radius 300: one border, Euler characteristic 1."""
    return implicit_surface(
        lambda p: np.linalg.norm(p, axis=1) - 300.0, lambda p: -p[:, 2], (-310, -310, -25), (310, 310, 310), edge
    )


def hourglass(edge: float = 11.0) -> Mesh:
    """A hyperboloid of one sheet: the fronts of its two borders meet head-on at the waist, z = 0."""
    return implicit_surface(
        lambda p: np.hypot(p[:, 0], p[:, 1]) - np.hypot(90.0, 0.75 * p[:, 2]),
        lambda p: np.abs(p[:, 2]) - 250.0,
        (-250, -250, -275),
        (250, 250, 275),
        edge,
    )


def handle(edge: float = 11.0) -> Mesh:
    """A torus with a hole in its side: genus 1, one border."""

    def torus(p: Array) -> Array:
        return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 200.0, p[:, 2]) - 90.0

    def hole(p: Array) -> Array:
        return 90.0 - np.linalg.norm(p - [255.0, 0.0, 70.0], axis=1)

    return implicit_surface(torus, hole, (-300, -300, -100), (300, 300, 100), edge)


def closed_body(edge: float = 10.5) -> Mesh:
    """A closed lumpy body of genus 0: three balls run together."""
    balls = ((-130.0, 0.0, 0.0, 120.0), (110.0, 30.0, 20.0, 150.0), (40.0, -150.0, 90.0, 80.0))

    def body(p: Array) -> Array:
        return smooth_least([np.linalg.norm(p - b[:3], axis=1) - b[3] for b in balls], 45.0)

    return implicit_surface(body, None, (-300, -290, -190), (310, 240, 250), edge)


def narrow_neck(edge: float = 8.5) -> Mesh:
    """Two domed lobes joined by a narrow neck: the offset of its one border pinches itself."""

    def outline(p: Array) -> Array:
        bridge = np.maximum(np.abs(p[:, 0]) - 210.0, 0.0)
        neck = np.hypot(bridge, p[:, 1]) - 45.0
        return smooth_least([disc(-230, 0, 170)(p), disc(210, 20, 140)(p), neck], 18.0)

    def height(p: Array) -> Array:
        x, y = p[:, 0], p[:, 1]
        return 110 * np.exp(-(((x + 240) / 150) ** 2 + (y / 150) ** 2)) + 0.0012 * (x - 30) ** 2 - 0.0006 * y**2

    return implicit_surface(height_field(height), outline, (-440, -220, -60), (390, 210, 300), edge)


def six_way_joint(edge: float = 11.0) -> Mesh:
    """Six round arms along the axes run together: six circular borders, Euler characteristic -4."""

    def joint(p: Array) -> Array:
        square = (p * p).sum(1, keepdims=True)
        from_axes = np.sqrt(np.maximum(square - p * p, 0.0))
        return smooth_least(list(from_axes.T), 40.0) - 75.0

    return implicit_surface(joint, lambda p: np.abs(p).max(1) - 300.0, (-325,) * 3, (325,) * 3, edge)


def minimal_surface(edge: float = 9.6) -> Mesh:
    """A gyroid trimmed by a ball of radius 302: two borders, genus 4, a threefold axis.

    The level set of the three trigonometric terms is minimal to about 3%; what is left of its
    mean curvature is taken out with the borders held.
    """
    radius = 302.0
    per_unit = 4.36 / radius

    def gyroid(p: Array) -> Array:
        x, y, z = (p * per_unit + np.pi / 4).T
        return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)

    vertices, faces = implicit_surface(
        gyroid, lambda p: np.linalg.norm(p, axis=1) - radius, (-320,) * 3, (320,) * 3, edge
    )
    return make_minimal(vertices, faces), faces


def shell_2400x1600(edge: float = 22.0) -> Mesh:
    """A freeform shell, 2.4 m by 1.6 m in plan, with two openings: three borders."""

    def outline(p: Array) -> Array:
        x, y = p[:, 0], p[:, 1]
        plan = 800.0 * (((x / 1200.0) ** 4 + (y / 800.0) ** 4) ** 0.25 - 1.0)
        oculus = 1.0 - np.hypot((x + 380.0) / 230.0, (y - 120.0) / 190.0)
        return np.maximum(plan, np.maximum(190.0 * oculus, -disc(560, -180, 150)(p)))

    def height(p: Array) -> Array:
        x, y = p[:, 0] / 1200.0, p[:, 1] / 800.0
        return 520.0 - 260.0 * x**2 - 300.0 * y**2 + 110.0 * np.sin(2.2 * x + 0.6) * np.cos(1.7 * y - 0.4)

    return implicit_surface(height_field(height), outline, (-1260, -860, -300), (1260, 860, 800), edge)
