"""Select objects of a Rhino file: by layer, by name or id, or the only candidate.

An object is a candidate if it is of a kind that a surface can be made of, and neither hidden, locked, on a layer
that is off or locked, nor only part of a block.  Others must be named; naming the layer is enough for those excluded
because of their layer.

One layer, or one name, may stand for several objects: they are joined if their edges connect them to one piece.
Objects that are each named are joined in any case.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Optional, Union

from weavecore.errors import AmbiguousSurface, NoSurface
from weavecore.reading.formats.rhino_3dm import SURFACE_KINDS, RhinoDocument, RhinoObject

Names = Union[str, Sequence[str], None]
"""A name, several, or none."""

_SEPARATOR = "::"
"""Between the names of nested layers in a full path, as Rhino writes it."""


@dataclass(frozen=True)
class Choice:
    """The selected objects, and whether each of them was named by itself.

    Parameters
    ----------
    objects : tuple of RhinoObject
        In the order of the file.
    is_listed : bool
    """

    objects: tuple[RhinoObject, ...]
    is_listed: bool


def choose_objects(document: RhinoDocument, *, layer: Names = None, object: Names = None) -> Choice:  # noqa: A002 - what a user calls it
    """Select one object, or several that are to make one surface.

    Parameters
    ----------
    document : RhinoDocument
    layer : str or sequence of str, optional
        ``Parent::Child`` or the last name alone; case is ignored unless it decides.  Objects on sublayers are
        selected if the layer holds none itself.
    object : str or sequence of str, optional
        Name or id of the object, or of each of several.

    Returns
    -------
    Choice

    Raises
    ------
    NoSurface, AmbiguousSurface
    """
    layers, names = listed_names(layer), listed_names(object)
    found: list[RhinoObject] = list(document.objects)
    if layers:
        found = _in_order(document, [one for name in layers for one in _on_layer(document, name)])
    among, selected = found, list[RhinoObject]()
    for name in names or (None,):
        found = among if name is None else _named(document, among, name, layers)
        surfaces = [one for one in found if one.is_surface]
        visible = [one for one in surfaces if not _is_excluded(one, layers)]
        if name is not None and not visible:
            visible = surfaces
        if not visible:
            raise _no_surface_error(document, found, surfaces, layers, name)
        selected += visible
    chosen = _in_order(document, selected)
    if len(chosen) > 1 and not layers and not names:
        raise ambiguous_error(document, chosen)
    return Choice(tuple(chosen), len(names) > 1)


def ambiguous_error(document: RhinoDocument, objects: Sequence[RhinoObject], why: str = "") -> AmbiguousSurface:
    """The error that lists several objects that a selection may stand for.

    Parameters
    ----------
    document : RhinoDocument
    objects : sequence of RhinoObject
    why : str, optional
        Why they do not make one surface, without a full stop.

    Returns
    -------
    AmbiguousSurface
    """
    return AmbiguousSurface(
        f"{document.file_name} has {len(objects)} candidate objects{why and ': '}{why}",
        remedy="Name one of them by its layer, name or id; name several to join them.",
        ids=[str(one) for one in objects],
    )


def listed_names(names: Names) -> tuple[str, ...]:
    """Names as a tuple, whether none, one or several are given.

    Parameters
    ----------
    names : str or sequence of str or None
    """
    if names is None:
        return ()
    return (names,) if isinstance(names, str) else tuple(names)


def _in_order(document: RhinoDocument, objects: Sequence[RhinoObject]) -> list[RhinoObject]:
    """Each object once, in the order of the file."""
    wanted = {id(one) for one in objects}
    return [one for one in document.objects if id(one) in wanted]


def is_candidate(one: RhinoObject) -> bool:
    """Whether an object is selected without being named.

    Parameters
    ----------
    one : RhinoObject
    """
    return one.is_surface and not one.aside


def _is_excluded(one: RhinoObject, layers: tuple[str, ...]) -> bool:
    return bool(one.aside) and not (layers and one.aside.startswith("on a layer"))


def _on_layer(document: RhinoDocument, layer: str) -> list[RhinoObject]:
    paths = matching_layers(document.layers, layer)
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


def matching_layers(layers: Iterable[str], layer: str) -> set[str]:
    """Full paths of the layers with a path, or else with that last name; an exact match precedes one that ignores
    case.

    Parameters
    ----------
    layers : iterable of str
        Full paths.
    layer : str

    Returns
    -------
    set of str
    """
    full = {path: path for path in layers}
    last = {path: path.split(_SEPARATOR)[-1] for path in full}
    for spelled in (str, str.casefold):
        for name in (full, last):
            found = {path for path in full if spelled(name[path]) == spelled(layer)}
            if found:
                return found
    return set()


def _named(document: RhinoDocument, among: list[RhinoObject], name: str, layers: tuple[str, ...]) -> list[RhinoObject]:
    found = [one for one in among if one.id.casefold() == name.strip("{}").casefold()]
    found = found or [one for one in among if one.name == name]
    if not found:
        where = _on_layers(layers)
        raise NoSurface(
            f"{document.file_name} has no object named {name!r}{where}",
            remedy="Name one of these by its name or id." if among else "Name another.",
            ids=[str(one) for one in among if one.is_surface],
            kind="there is",
        )
    return found


def _no_surface_error(
    document: RhinoDocument,
    found: list[RhinoObject],
    surfaces: list[RhinoObject],
    layers: tuple[str, ...],
    name: Optional[str],
) -> NoSurface:
    where = _on_layers(layers)
    where += f" named {name!r}" if name is not None else ""
    if surfaces:
        return NoSurface(
            f"{document.file_name} has surfaces{where}, all of them hidden, locked or part of a block",
            remedy="Show one, or name it by its name or id.",
            ids=[f"{one}, {one.aside}" for one in surfaces],
        )
    counts = Counter(one.kind for one in found)
    contents = ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())) or "no objects"
    return NoSurface(
        f"{document.file_name} has no surface{where}, only: {contents}",
        remedy=f"Give a file with one of: {', '.join(SURFACE_KINDS)}.",
    )


def _on_layers(layers: tuple[str, ...]) -> str:
    return f" on layer {' or '.join(repr(one) for one in layers)}" if layers else ""
