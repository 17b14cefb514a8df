"""Rhino files .3dm: their objects, and which of them a surface can be made of."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from weavecore.errors import Unreadable, Unsupported
from weavecore.files import PathLike
from weavecore.reading.formats.mesh_file import check_file
from weavecore.reading.nurbs_mesher import MESHED_KINDS, holds_surface

_SIGNATURE = b"3D Geometry File Format "
"""First bytes of every Rhino file; the version follows."""

_VERSIONS = range(2, 9)
"""Versions that rhino3dm reads and that were tested."""


BLOCK = "Block"
"""Kind of a reference to a block that holds a surface."""

IN_BLOCK = "part of a block"
"""Why an object that belongs only to the definition of a block is excluded."""

CURVE = "Curve"
"""Rhino's name for curves, lines, arcs and polylines of all kinds."""

SURFACE_KINDS = ("Mesh", *MESHED_KINDS, BLOCK)
"""Rhino's names for the kinds of object that a surface can be made of."""


@dataclass(frozen=True)
class RhinoObject:
    """One object of a Rhino file.

    Parameters
    ----------
    id, name, kind : str
        Its id, its name ("" if none; of a block that of its definition) and Rhino's name for its kind.
    layer : str
        Full path of its layer, ``Parent::Child``; "" if the file has no layers.
    aside : str
        Why it is not selected unless it is named: "hidden", "locked", "on a layer that is off",
        "on a layer that is locked", "part of a block"; "" otherwise.
    geometry : object
        The rhino3dm geometry.
    """

    id: str
    name: str
    kind: str
    layer: str
    aside: str
    geometry: Any = field(repr=False, compare=False)

    @property
    def is_surface(self) -> bool:
        """Whether it is of a kind that a surface can be made of."""
        return self.kind in SURFACE_KINDS

    def __str__(self) -> str:
        called = f" {self.name!r}" if self.name else ""
        where = f" on layer {self.layer!r}" if self.layer else ""
        return f"{self.kind}{called} {self.id}{where}"


@dataclass(frozen=True)
class RhinoDocument:
    """The contents of a Rhino file.

    Parameters
    ----------
    file_name : str
    version : int
        2 to 8.
    unit : str
        Rhino's name of the unit, ``"None"`` if it has none.
    tolerance : float
        Absolute tolerance in that unit.
    layers : tuple of str
        Full paths.
    objects : tuple of RhinoObject
        In the order of the file.
    """

    file_name: str
    version: int
    unit: str
    tolerance: float
    layers: tuple[str, ...]
    objects: tuple[RhinoObject, ...]
    source: Any = field(repr=False, compare=False)


def open_document(path: PathLike) -> RhinoDocument:
    """Read a Rhino file.

    Parameters
    ----------
    path : path

    Returns
    -------
    RhinoDocument

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork
    """
    import rhino3dm

    version = check_header(path)
    source: Any = rhino3dm.File3dm.Read(str(path))
    if source is None:
        raise Unreadable(f"{path} is damaged", remedy="Open it in Rhino, repair it there and save it again.")
    layers, aside = _layers(source)
    objects = tuple(_object(item, layers, aside, source) for item in source.Objects)
    settings = source.Settings
    return RhinoDocument(
        file_name=Path(path).name,
        version=version,
        unit=settings.ModelUnitSystem.name,
        tolerance=_sound(float(settings.ModelAbsoluteTolerance)),
        layers=tuple(layers.values()),
        objects=objects,
        source=source,
    )


def _sound(tolerance: float) -> float:
    """The tolerance of a file; 0 if it is not a positive length."""
    return tolerance if math.isfinite(tolerance) and tolerance > 0 else 0.0


def check_header(path: PathLike) -> int:
    """Version of Rhino of the file, from its first bytes.

    Parameters
    ----------
    path : path

    Returns
    -------
    int

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork
    """
    check_file(path)
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(32)
    except OSError as error:
        raise Unreadable(f"{path} cannot be read: {error.strerror}", remedy="Check the file permissions.") from error
    number = head[24:].strip()
    if not head.startswith(_SIGNATURE) or not number.isdigit():
        raise Unreadable(f"{path} is not a Rhino file", remedy="Use a .3dm that Rhino saved.")
    version = int(number) // 10 if int(number) >= 50 else int(number)
    if version not in _VERSIONS:
        raise Unsupported(
            f"{path} is a file of Rhino version {version}",
            remedy=f"Save it as one of the versions {_VERSIONS[0]} to {_VERSIONS[-1]}.",
        )
    return version


def _layers(source: Any) -> tuple[dict[int, str], dict[int, str]]:
    """Full path of each layer by its index, and why its objects are excluded."""
    layers = list(source.Layers)
    by_id = {str(layer.Id): layer for layer in layers}
    paths, aside = {}, {}
    for layer in layers:
        chain, above = [layer], str(layer.ParentLayerId)
        while above in by_id and len(chain) <= len(layers):
            chain.append(by_id[above])
            above = str(by_id[above].ParentLayerId)
        paths[layer.Index] = layer.FullPath
        if not all(one.Visible for one in chain):
            aside[layer.Index] = "on a layer that is off"
        elif any(one.Locked for one in chain):
            aside[layer.Index] = "on a layer that is locked"
    return paths, aside


def _definition_name(source: Any, reference: Any) -> str:
    """Name of the block of a reference, which seldom has a name of its own."""
    definition = source.InstanceDefinitions.FindId(reference.ParentIdefId)
    return "" if definition is None else definition.Name or ""


def _object(item: Any, layers: dict[int, str], layer_aside: dict[int, str], source: Any) -> RhinoObject:
    attributes, geometry = item.Attributes, item.Geometry
    kind = geometry.ObjectType.name if geometry is not None else "None"
    if kind == "InstanceReference" and holds_surface(source, geometry):
        kind = BLOCK
    mode = attributes.Mode.name
    if attributes.IsInstanceDefinitionObject:
        aside = IN_BLOCK
    elif mode == "Hidden" or not attributes.Visible:
        aside = "hidden"
    elif mode == "Locked":
        aside = "locked"
    else:
        aside = layer_aside.get(attributes.LayerIndex, "")
    return RhinoObject(
        id=str(attributes.Id),
        name=attributes.Name or (_definition_name(source, geometry) if kind == BLOCK else ""),
        kind=kind,
        layer=layers.get(attributes.LayerIndex, ""),
        aside=aside,
        geometry=geometry,
    )
