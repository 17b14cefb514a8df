"""Which object of a Rhino file is meant.

By layer, by name or id, or the only one there is.  What is hidden, locked, on a layer that
is off, or part of a block, is not meant unless it is named; naming the layer is enough for
what is aside because of its layer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Optional

from weavecore.errors import AmbiguousSurface, NoSurface
from weavecore.reading.rhino_file import SURFACE_KINDS, RhinoDocument, RhinoObject

_SEPARATOR = "::"


def choose_object(document: RhinoDocument, *, layer: Optional[str] = None, object: Optional[str] = None) -> RhinoObject:  # noqa: A002
    """The one object that is meant.

    Parameters
    ----------
    document : RhinoDocument
    layer : str, optional
        ``Parent::Child`` or the last name alone; upper and lower case are the same.
        Objects on layers below it are meant where it holds none itself.
    object : str, optional
        Name or id of the object.

    Raises
    ------
    NoSurface, AmbiguousSurface
    """
    found: list[RhinoObject] = list(document.objects)
    if layer is not None:
        found = _on_layer(document, layer)
    if object is not None:
        found = _named(document, found, object, layer)
    surfaces = [one for one in found if one.is_surface]
    shown = [one for one in surfaces if not _is_aside(one, layer)]
    if object is not None and not shown:
        shown = surfaces
    if len(shown) == 1:
        return shown[0]
    if shown:
        raise AmbiguousSurface(
            f"{document.file_name} has {len(shown)} objects that could be meant",
            remedy="Name one of them by its layer, its name or its id.",
            ids=[str(one) for one in shown],
        )
    raise _none(document, found, surfaces, layer, object)


def is_candidate(one: RhinoObject) -> bool:
    """Whether the object can be meant without being named."""
    return one.is_surface and not one.aside


def _is_aside(one: RhinoObject, layer: Optional[str]) -> bool:
    return bool(one.aside) and not (layer is not None and one.aside.startswith("on a layer"))


def _on_layer(document: RhinoDocument, layer: str) -> list[RhinoObject]:
    paths = _layers_meant(document.layers, layer)
    if not paths:
        raise NoSurface(
            f"{document.file_name} has no layer {layer!r}",
            remedy="Name one of its layers.",
            ids=document.layers,
            kind="layers are",
        )
    on_it = [one for one in document.objects if one.layer in paths]
    if any(one.is_surface for one in on_it):
        return on_it
    below = tuple(path + _SEPARATOR for path in paths)
    return on_it + [one for one in document.objects if one.layer.startswith(below)]


def _layers_meant(layers: Iterable[str], layer: str) -> set[str]:
    """Layers with this full path, or else with this last name; the spelling as it is goes first."""
    full = {path: path for path in layers}
    last = {path: path.split(_SEPARATOR)[-1] for path in full}
    for spelt in (str, str.casefold):
        for name in (full, last):
            found = {path for path in full if spelt(name[path]) == spelt(layer)}
            if found:
                return found
    return set()


def _named(document: RhinoDocument, among: list[RhinoObject], name: str, layer: Optional[str]) -> list[RhinoObject]:
    found = [one for one in among if one.id.casefold() == name.strip("{}").casefold()]
    found = found or [one for one in among if one.name == name]
    if not found:
        where = f" on layer {layer!r}" if layer is not None else ""
        raise NoSurface(
            f"{document.file_name} has no object named {name!r}{where}",
            remedy="Name one of these by its name or id." if among else "Name another.",
            ids=[str(one) for one in among if one.is_surface],
            kind="there is",
        )
    return found


def _none(
    document: RhinoDocument,
    found: list[RhinoObject],
    surfaces: list[RhinoObject],
    layer: Optional[str],
    name: Optional[str],
) -> NoSurface:
    where = f" on layer {layer!r}" if layer is not None else ""
    where += f" named {name!r}" if name is not None else ""
    if surfaces:
        return NoSurface(
            f"{document.file_name} has surfaces{where}, but none that is shown",
            remedy="Show one, or name it by its name or id.",
            ids=[f"{one}, {one.aside}" for one in surfaces],
        )
    counts = Counter(one.kind for one in found)
    there = ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())) or "no objects"
    return NoSurface(
        f"{document.file_name} has no surface{where}, only: {there}",
        remedy=f"Give a file with one of: {', '.join(SURFACE_KINDS)}.",
    )
