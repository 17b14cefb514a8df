"""Surfaces that rhino3dm can make, for the tests of what reads them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

r = pytest.importorskip("rhino3dm")


def point(x: float, y: float, z: float) -> Any:
    return r.Point3d(x, y, z)


def vertical_axis() -> Any:
    return r.Line(point(0, 0, 0), point(0, 0, 1))


def circle(radius: float, height: float = 0.0) -> Any:
    return r.NurbsCurve.CreateFromCircle(r.Circle(point(0, 0, height), radius))


def arc(start: tuple[float, ...], middle: tuple[float, ...], end: tuple[float, ...]) -> Any:
    return r.NurbsCurve.CreateFromArc(r.Arc(point(*start), point(*middle), point(*end)))


def polyline(*corners: tuple[float, ...]) -> Any:
    return r.PolylineCurve([point(*corner) for corner in corners])


def box() -> Any:
    return r.Brep.CreateFromBox(r.Box(r.BoundingBox(point(0, 0, 0), point(1, 2, 3))))


def sphere(radius: float = 2.0) -> Any:
    return r.Brep.CreateFromSphere(r.Sphere(point(0, 0, 0), radius))


def tube(radius: float = 1.0, height: float = 2.0) -> Any:
    return r.Brep.CreateFromCylinder(r.Cylinder(r.Circle(point(0, 0, 0), radius), height), False, False)


def can(radius: float = 1.0, height: float = 2.0) -> Any:
    return r.Brep.CreateFromCylinder(r.Cylinder(r.Circle(point(0, 0, 0), radius), height), True, True)


def cone() -> Any:
    return r.RevSurface.Create(r.LineCurve(point(0, 0, 0), point(1, 0, 2)), vertical_axis(), 0.0, 2 * math.pi)


def torus() -> Any:
    ring = circle(1.0)
    ring.Rotate(math.pi / 2, r.Vector3d(1, 0, 0), point(0, 0, 0))
    ring.Translate(r.Vector3d(3, 0, 0))
    return r.RevSurface.Create(ring, vertical_axis(), 0.0, 2 * math.pi)


def bowl(turn: float = 0.0) -> Any:
    """Half a sphere of radius 1 about (0, 0, 2), open below; its seam turned about the axis."""
    s = math.sqrt(0.5)
    return r.RevSurface.Create(arc((1, 0, 2), (s, 0, 2 + s), (0, 0, 3)), vertical_axis(), turn, turn + 2 * math.pi)


def hourglass() -> Any:
    profile = r.NurbsCurve.Create(False, 3, [point(2, 0, 0), point(0.3, 0, 1), point(0.3, 0, 2), point(2, 0, 3)])
    return r.RevSurface.Create(profile, vertical_axis(), 0.0, 2 * math.pi)


def half_tube() -> Any:
    return r.RevSurface.Create(r.LineCurve(point(1, 0, 0), point(1, 0, 3)), vertical_axis(), 0.0, math.pi)


def plate() -> Any:
    return r.PlaneSurface(r.Plane.WorldXY(), r.Interval(0, 3), r.Interval(0, 2))


def disc() -> Any:
    return r.Brep.CreateTrimmedPlane(r.Plane.WorldXY(), circle(1.5))


def star() -> Any:
    """A plane trimmed by a polygon with deep notches."""
    angle = np.arange(21) * 2 * math.pi / 20
    radius = np.where(np.arange(21) % 2 == 0, 2.0, 0.7)
    corners = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    return r.Brep.CreateTrimmedPlane(r.Plane.WorldXY(), polyline(*corners.tolist()))


def saddle() -> Any:
    low = r.NurbsCurve.Create(False, 3, [point(0, 0, 0), point(1, 0, 1), point(2, 0, 1), point(3, 0, 0)])
    high = r.NurbsCurve.Create(False, 3, [point(0, 3, 1), point(1, 3, 0), point(2, 3, 0), point(3, 3, 1)])
    return r.NurbsSurface.CreateRuledSurface(low, high)


def fan() -> Any:
    """A flat strip ten times as wide at one end as at the other."""
    return r.NurbsSurface.CreateRuledSurface(
        r.LineCurve(point(0, 0, 0), point(0.2, 0, 0)), r.LineCurve(point(-1, 2, 0), point(1, 2, 0))
    )


def folded() -> Any:
    """A surface of one face with a crease inside: a polyline swept along a line."""
    low = polyline((0, 0, 0), (1, 0, 0), (1, 0, 1), (2, 0, 1)).ToNurbsCurve()
    high = polyline((0, 2, 0), (1, 2, 0), (1, 2, 1), (2, 2, 1)).ToNurbsCurve()
    return r.NurbsSurface.CreateRuledSurface(low, high)


def pipe() -> Any:
    """An extrusion with a hole through it, capped."""
    return r.Extrusion.CreatePipeExtrusion(r.Cylinder(r.Circle(point(0, 0, 0), 2.0), 3.0), 1.0, True, True)


def punched() -> Any:
    """A block of 4 by 3 by 1 with a round hole of radius 1 through it."""
    block = r.Extrusion.Create(polyline((0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0), (0, 0, 0)), 1.0, True)
    inner = circle(1.0)
    inner.Translate(r.Vector3d(2, 1.5, 0))
    block.AddInnerProfile(inner)
    return block


def beam() -> Any:
    """An extruded polyline, open: an angle of two faces."""
    return r.Extrusion.Create(polyline((0, 0, 0), (2, 0, 0), (2, 1, 0)), 3.0, False)


def square(*corners: tuple[float, ...]) -> Any:
    a, b, c, d = (point(*corner) for corner in corners)
    return r.NurbsSurface.CreateRuledSurface(r.LineCurve(a, b), r.LineCurve(d, c))
