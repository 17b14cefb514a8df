"""Distances between line segments."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats

_TINY = np.finfo(float).tiny


def segment_distances(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Distance (n,) of each segment ab to its segment cd, and the middle (n, 3) between the nearest points.

    Source: Ericson, *Real-Time Collision Detection*, §5.1.9.
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (u * u).sum(1), (v * v).sum(1), (u * v).sum(1)
    uw, vw = (u * w).sum(1), (v * w).sum(1)
    det = uu * vv - uv * uv
    s = np.clip(np.divide(uv * vw - uw * vv, det, out=np.zeros_like(det), where=det > 1e-12 * uu * vv), 0.0, 1.0)
    t = np.clip((uv * s + vw) / np.maximum(vv, _TINY), 0.0, 1.0)
    s = np.clip((uv * t - uw) / np.maximum(uu, _TINY), 0.0, 1.0)
    p, q = a + u * s[:, None], c + v * t[:, None]
    return np.linalg.norm(p - q, axis=1), (p + q) / 2.0
