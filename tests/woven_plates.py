"""Plates with corners, and a saddle, woven with rings 20 apart; the tests share them."""

from __future__ import annotations

from functools import cache

import numpy as np

from planar_meshes import plate
from weavecore import pipeline
from weavecore.model import SurfaceMesh, Weave

TONGUE = [(0, 0), (320, 0), (320, 200), (195, 200), (195, 380), (125, 380), (125, 200), (0, 200)]
"""A plate with a tongue of 70 x 180."""

SQUARE = [(0, 0), (240, 0), (240, 240), (0, 240)]


@cache
def woven_plate(shape: str, pattern: str) -> Weave:
    vertices, faces = plate([np.array(TONGUE if shape == "tongue" else SQUARE, float)], edge=10.0)
    if shape == "saddle":
        x, y = (vertices[:, :2] - 120.0).T
        vertices = np.c_[vertices[:, :2], (x**2 - y**2) / 300.0]
    latitudes = pipeline.offset(SurfaceMesh(vertices, faces, unit="Millimeters"), spacing=20.0)
    return pipeline.weave(pipeline.link(latitudes, pattern=pattern))
