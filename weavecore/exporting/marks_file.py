"""The .3dm of places to look at: bad edges, gaps and borders as coloured curves, notes as dots."""

from __future__ import annotations

from collections.abc import Sequence

from weavecore.exporting.rhino_builder import RhinoFileBuilder
from weavecore.model import InspectionMark

_COLOURS = {"edges": (214, 30, 30), "gaps": (240, 130, 0), "notes": (150, 40, 170), "borders": (60, 60, 66)}
"""Colour of each layer."""


def encode_marks(marks: Sequence[InspectionMark], *, unit: str, tolerance: float) -> bytes:
    """Write marks, on a layer for each kind.

    Parameters
    ----------
    marks : sequence of InspectionMark
    unit : str
        Rhino's name.
    tolerance : float

    Returns
    -------
    bytes
    """
    builder = RhinoFileBuilder(unit, tolerance, seed="marks")
    for number, mark in enumerate(marks):
        layer = builder.layer(f"marks::{mark.kind}", _COLOURS[mark.kind])
        name = f"{number}: {mark.text}"
        if len(mark.points) == 1:
            builder.add_dot(mark.points[0], layer, mark.text)
        else:
            builder.add_polyline(mark.points, layer, name, {})
    return builder.encode()
