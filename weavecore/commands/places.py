"""Supports and loads as they are typed: ``FILE.3dm:LAYER``, and a force ``X,Y,Z``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import typer

if TYPE_CHECKING:
    from weavecore.geometry.arrays import Floats

_RHINO_LAYER = re.compile(r"(?P<file>.*\.3dm)(:(?P<layer>.+))?", re.IGNORECASE)
"""A path that ends with .3dm and, after a colon, the name or the full path of a layer (``Parent::Child``)."""

_CURVE_FILES = (".csv", ".txt", ".xyz")


@dataclass(frozen=True)
class Force:
    """A force in N as it is typed."""

    parts: tuple[float, ...]


def force_of(text: str) -> Force:
    """Parse a force from three numbers between commas.

    Parameters
    ----------
    text : str

    Returns
    -------
    Force

    Raises
    ------
    typer.BadParameter
        Where they are not three finite numbers, or all are 0.
    """
    try:
        parts = tuple(float(part) for part in text.split(","))
    except ValueError:
        parts = ()
    if len(parts) != 3 or not all(abs(x) < float("inf") for x in parts) or not any(parts):
        raise typer.BadParameter(f"{text!r} is not a force; give x,y,z in N: 0,0,-10")
    return Force(parts)


def read_supports(text: str, *, unit: str, time_limit: Optional[float]) -> Union[str, list[Floats]]:
    """Read the supports that a text names.

    Parameters
    ----------
    text : str
        A word, which is returned; ``FILE.3dm``, with ``:LAYER`` or without; or a text file of one curve.
    unit : str
        Unit of the weave, to which lengths of Rhino files are converted.
    time_limit : float or None
        In seconds, for the file.

    Returns
    -------
    str or list of (n, 3) float64

    Raises
    ------
    WeaveError
        As `weavecore.pipeline.read_places`.
    """
    from weavecore import pipeline

    found = _RHINO_LAYER.fullmatch(text)
    if found:
        places = _places(found, unit=unit, time_limit=time_limit)
        return [points for points, _ in places]
    if text.lower().endswith(_CURVE_FILES):
        return pipeline.read_curves(text, unit=unit, guarded=True, time_limit=time_limit)
    return text


def read_loads(
    text: str, force: Optional[Force], *, unit: str, time_limit: Optional[float]
) -> list[tuple[Floats, Any]]:
    """Read the forces on points of a Rhino file.

    Parameters
    ----------
    text : str
        ``FILE.3dm``, with ``:LAYER`` or without.
    force : Force or None
        On points that state none.
    unit, time_limit
        As in `read_supports`.

    Returns
    -------
    list of ((3,), (3,))
        Places and forces in N; those of a curve lie along it, each with the whole force.

    Raises
    ------
    WeaveError
        As `weavecore.pipeline.read_places`; `Unsupported` where a point has no force.
    """
    from weavecore.errors import Unsupported

    found = _RHINO_LAYER.fullmatch(text)
    if not found:
        raise Unsupported(f"{text} is not a Rhino file", remedy="Give the loads as points: FILE.3dm:LAYER.")
    loads = []
    for points, own in _places(found, unit=unit, time_limit=time_limit):
        acting = own if own is not None else force and force.parts
        if acting is None:
            raise Unsupported(
                f"A point in {found['file']} states no force",
                remedy="Give it a user text force = x, y, z in N, or add --force X,Y,Z.",
            )
        loads += [(point, acting) for point in points]
    return loads


def _places(found: re.Match[str], *, unit: str, time_limit: Optional[float]) -> Any:
    from weavecore import pipeline

    return pipeline.read_places(found["file"], layer=found["layer"], unit=unit, guarded=True, time_limit=time_limit)
