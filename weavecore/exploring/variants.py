"""Variants of a weave: the grid of options, in a fixed order, and a key that names each of them.

A *variant* is a surface with one choice of each option.  A *group* is the variants of a surface with the same borders
and spacing: they differ in pattern, rod and material only and share one offset::

    surfaces × borders × spacings   ──▶ groups, one offset each
                       × patterns × rods × materials ──▶ variants

The key of a variant is a hash of the surface, the options and the version of weavecore: a result is found again by its
key, whatever else is in the grid.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Optional, TypeVar, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.linking.link import known_pattern
from weavecore.model import SurfaceMesh
from weavecore.units import Length
from weavecore.version import installed_version
from weavecore.weaving.materials import material_named

ALL, STOCK = "all", "stock"
"""How every border, and a diameter chosen from the stock, are written in tables."""

_KEY_DIGITS = 16
"""Hexadecimal digits of a key: 64 bits, so that among a million variants two keys are equal with odds of 3e-8."""

_Value = TypeVar("_Value")

Borders = Optional[tuple[int, ...]]
"""Numbers of the borders at which distances start; None for all."""


@dataclass(frozen=True)
class Variant:
    """A surface and one choice of each option.

    Parameters
    ----------
    surface : str
        Name of the surface in the table.
    digest : str
        Hash of the surface; see `digest_surface`.
    unit : str
        Rhino's name of the surface's unit, in which all lengths are.
    borders : tuple of int or None
        Numbers of the borders at which distances start; None for all.
    spacing : float
    pattern : str
    rod : float or None
        Diameter; None for the thickest of the stock in which nearly all rods can be bent.
    material : str
    is_simulated : bool
        Whether the rods come to rest, with the borders held.
    """

    surface: str
    digest: str
    unit: str
    borders: Borders
    spacing: float
    pattern: str
    rod: Optional[float]
    material: str
    is_simulated: bool = False

    @property
    def key(self) -> str:
        """Name of the variant's files."""
        options = [self.digest, self.unit, self.borders, self.spacing, self.pattern, self.rod, self.material]
        text = json.dumps([installed_version(), *options, self.is_simulated])
        return hashlib.sha256(text.encode()).hexdigest()[:_KEY_DIGITS]

    @property
    def borders_text(self) -> str:
        """The borders as they are typed: ``all``, ``0`` or ``0+2``."""
        return ALL if self.borders is None else "+".join(map(str, self.borders))

    @property
    def rod_text(self) -> str:
        """The diameter as it is typed, or ``stock``."""
        return STOCK if self.rod is None else f"{self.rod:.12g}"


@dataclass(frozen=True)
class Group:
    """Variants that share one offset, in the order of the grid; see the module."""

    variants: tuple[Variant, ...]

    @property
    def digest(self) -> str:
        """Of the surface."""
        return self.variants[0].digest


def digest_surface(surface: SurfaceMesh) -> str:
    """Hash a surface: its shape, unit, cuts and origins, but not its name.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    content = hashlib.sha256(f"{surface.unit} {surface.tolerance!r}".encode())
    paths = () if surface.starts is None else surface.starts.paths
    for array in (surface.vertices, surface.faces, *surface.cuts, np.zeros(0), *paths):
        content.update(f"{array.shape}".encode())
        content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()


def make_grid(
    surface: SurfaceMesh,
    name: str,
    *,
    spacings: Sequence[Union[float, Length]],
    patterns: Sequence[str],
    rods: Sequence[Union[float, Length, str]],
    materials: Sequence[str],
    borders: Sequence[Union[Sequence[int], str]],
    is_simulated: bool = False,
) -> list[Group]:
    """All combinations of the options for one surface, each once.

    Parameters
    ----------
    surface : SurfaceMesh
    name : str
        Of the surface in the table.
    spacings : sequence of float or Length
        Numbers are in the unit of the surface.
    patterns, materials : sequence of str
    rods : sequence of float, Length or ``"stock"``
        Diameters; numbers are in the unit of the surface.
    borders : sequence of sequences of int, or ``"all"``
    is_simulated : bool

    Returns
    -------
    list of Group

    Raises
    ------
    Unsupported
        Where an option has no value, or a pattern or a material is not known.
    """
    _check_options(spacings=spacings, patterns=patterns, rods=rods, materials=materials, borders=borders)
    for pattern in patterns:
        known_pattern(pattern)
    for material in materials:
        material_named(material)
    digest, unit = digest_surface(surface), surface.unit
    chosen = _once(None if one == ALL else tuple(int(n) for n in one) for one in borders)
    diameters = _once(None if rod == STOCK else length_in(rod, unit) for rod in rods)
    return [
        Group(
            tuple(
                Variant(name, digest, unit, border, spacing, pattern, rod, material, is_simulated)
                for pattern in _once(patterns)
                for rod in diameters
                for material in _once(materials)
            )
        )
        for border in chosen
        for spacing in _once(length_in(one, unit) for one in spacings)
    ]


def length_in(length: Union[float, Length, str], unit: str) -> float:
    """A length as a number in a unit.

    Parameters
    ----------
    length : float or Length
        A number is in the unit.
    unit : str
        Rhino's name.

    Raises
    ------
    Unsupported
        Where it is neither, or cannot be converted.
    """
    if isinstance(length, Length):
        return length.in_unit(unit)
    try:
        return float(length)
    except (TypeError, ValueError) as error:
        raise Unsupported(f"{length!r} is not a length", remedy="Give a number.") from error


def steps_between(start: float, stop: float, step: float) -> list[float]:
    """The numbers from ``start`` to ``stop``, both included, by equal steps.

    Parameters
    ----------
    start, stop, step : float
        ``step`` is positive and ``stop`` is not below ``start``.

    Returns
    -------
    list of float
        Rounded to twelve digits, so that 0.1 + 2 · 0.1 is 0.3.

    Raises
    ------
    Unsupported
    """
    if not (0 < step < np.inf and start <= stop < np.inf):
        raise Unsupported(f"{start:g}:{stop:g}:{step:g} is not a range", remedy="Write START:STOP:STEP, rising.")
    # A stop that is missed by rounding alone is still reached.
    count = int(np.floor((stop - start) / step + 1e-9)) + 1
    return [float(f"{start + k * step:.12g}") for k in range(count)]


def _check_options(**options: Sequence[object]) -> None:
    for label, values in options.items():
        if isinstance(values, str) or not len(values):
            raise Unsupported(
                f"{label} must be a list of at least one value (got {values!r})", remedy=f"Give a list of {label}."
            )


def _once(values: Iterable[_Value]) -> list[_Value]:
    """The values in their order, each once."""
    return list(dict.fromkeys(values))
