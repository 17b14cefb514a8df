"""Arc tangent, logarithm, sine and cosine of arrays, with the same last bit on every processor.

The libraries that NumPy calls for these round the last bit differently from release to release and from processor to
processor.  Here they are made of additions, multiplications and divisions alone, which IEEE 754 rounds correctly.  The
error is a few units in the last place.

Source: the rational approximations of Moshier 1989, *Methods and Programs for Mathematical Functions* (Cephes).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from weavecore.geometry.arrays import Floats, blocks

_ARCTANGENT_ABOVE = (
    -8.750608600031904122785e-1,
    -1.615753718733365076637e1,
    -7.500855792314704667340e1,
    -1.228866684490136173410e2,
    -6.485021904942025371773e1,
)
_ARCTANGENT_BELOW = (
    1.0,
    2.485846490142306297962e1,
    1.650270098316988542046e2,
    4.328810604912902668951e2,
    4.853903996359136964868e2,
    1.945506571482613964425e2,
)

_SLANTED = 0.66
"""Tangent above which the arc tangent is that of (x - 1)/(x + 1) plus π/4."""

_LOG_ABOVE = (
    1.01875663804580931796e-4,
    4.97494994976747001425e-1,
    4.70579119878881725854e0,
    1.44989225341610930846e1,
    1.79368678507819816313e1,
    7.70838733755885391666e0,
)
_LOG_BELOW = (
    1.0,
    1.12873587189167450590e1,
    4.52279145837532221105e1,
    8.29875266912776603211e1,
    7.11544750618563894466e1,
    2.31251620126765340583e1,
)
_ROOT_HALF = 0.70710678118654752440
_LOG_TWO = (0.693359375, -2.121944400546905827679e-4)
"""Logarithm of 2 in two parts, the first short enough that its multiples are exact."""

_SINE = (
    1.58962301576546568060e-10,
    -2.50507477628578072866e-8,
    2.75573136213857245213e-6,
    -1.98412698295895385996e-4,
    8.33333333332211858878e-3,
    -1.66666666666666307295e-1,
)
_COSINE = (
    -1.13585365213876817300e-11,
    2.08757008419747316778e-9,
    -2.75573141792967388112e-7,
    2.48015872888517045348e-5,
    -1.38888888888730564116e-3,
    4.16666666666665929218e-2,
)
_EIGHTHS = (7.85398125648498535156e-1, 3.77489470793079817668e-8, 2.69515142907905952645e-15)
"""π/4 in three parts, whose small multiples are exact."""


def _polynomial(x: Floats, coefficients: Sequence[float]) -> Floats:
    total = np.full(x.shape, coefficients[0])
    for one in coefficients[1:]:
        total *= x
        total += one
    return total


def arctangents(y: ArrayLike, x: ArrayLike) -> Floats:
    """Angles of vectors (x, y), as NumPy's ``arctan2``.

    Parameters
    ----------
    y, x : (…) array_like of float

    Returns
    -------
    (…) float64
        Radians, from -π to π; 0 of vectors without a length.
    """
    y, x = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(x, np.float64))
    rows, columns, angles = y.ravel(), x.ravel(), np.empty(y.size)
    for k in blocks(len(angles)):
        angles[k] = _arctangents(rows[k], columns[k])
    return angles.reshape(y.shape)


def _arctangents(y: Floats, x: Floats) -> Floats:
    high, wide = np.abs(y), np.abs(x)
    # The quotient is at most 1: of steeper vectors the complement is taken.
    is_steep = high > wide
    low, great = np.where(is_steep, wide, high), np.where(is_steep, high, wide)
    quotient = np.divide(low, great, out=np.zeros(low.shape), where=great > 0)
    is_slanted = quotient > _SLANTED
    reduced = np.where(is_slanted, (quotient - 1.0) / (quotient + 1.0), quotient)
    square = reduced * reduced
    ratio = _polynomial(square, _ARCTANGENT_ABOVE) / _polynomial(square, _ARCTANGENT_BELOW)
    angle = reduced + reduced * (square * ratio)
    angle = np.where(is_slanted, angle + np.pi / 4, angle)
    angle = np.where(is_steep, np.pi / 2 - angle, angle)
    angle = np.where(x < 0, np.pi - angle, angle)
    angles: Floats = np.where(y < 0, -angle, angle)
    return angles


def angles_between(one: Floats, other: Floats) -> Floats:
    """Angles between unit vectors.

    Parameters
    ----------
    one, other : (n, k) float64

    Returns
    -------
    (n,) float64
        Radians, from 0 to π.
    """
    cosine = np.clip((one * other).sum(1), -1.0, 1.0)
    return arctangents(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)


def logarithms(x: ArrayLike) -> Floats:
    """Natural logarithms.

    Parameters
    ----------
    x : (…) array_like of float
        Positive.

    Returns
    -------
    (…) float64
    """
    part, power = np.frexp(np.asarray(x, np.float64))
    is_small = part < _ROOT_HALF
    power = (power - is_small).astype(np.float64)
    part = np.where(is_small, part + part, part) - 1.0
    square = part * part
    ratio = _polynomial(part, _LOG_ABOVE) / _polynomial(part, _LOG_BELOW)
    rest = part * (square * ratio) + power * _LOG_TWO[1] - 0.5 * square
    logs: Floats = (part + rest) + power * _LOG_TWO[0]
    return logs


def sines_and_cosines(angle: ArrayLike) -> tuple[Floats, Floats]:
    """Sines and cosines.

    Parameters
    ----------
    angle : (…) array_like of float
        Radians, of some turns at most.

    Returns
    -------
    sine, cosine : (…) float64
    """
    angle = np.asarray(angle, np.float64)
    flat, sine, cosine = angle.ravel(), np.empty(angle.size), np.empty(angle.size)
    for k in blocks(len(flat)):
        sine[k], cosine[k] = _sines_and_cosines(flat[k])
    return sine.reshape(angle.shape), cosine.reshape(angle.shape)


def _sines_and_cosines(angle: Floats) -> tuple[Floats, Floats]:
    size = np.abs(angle)
    octant = np.floor(size / (np.pi / 4))
    octant += octant % 2
    rest = ((size - octant * _EIGHTHS[0]) - octant * _EIGHTHS[1]) - octant * _EIGHTHS[2]
    square = rest * rest
    sine = rest + rest * (square * _polynomial(square, _SINE))
    cosine = (1.0 - 0.5 * square) + square * (square * _polynomial(square, _COSINE))
    quarter = (octant / 2) % 4
    is_odd = quarter % 2 == 1
    sine, cosine = np.where(is_odd, cosine, sine), np.where(is_odd, sine, cosine)
    sine = np.where((quarter >= 2) != (angle < 0), -sine, sine)
    cosine = np.where((quarter == 1) | (quarter == 2), -cosine, cosine)
    return sine, cosine
