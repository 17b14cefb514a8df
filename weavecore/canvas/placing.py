"""Lists of names that appear beside a component when it is placed, and are wired to its inputs.

A component counts as just placed while nothing is wired to any input and no lists were made for it.  Objects cannot be
added during a solution, so that is done right after it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from weavecore.canvas.caching import ComponentCache

_DELAY = 5
"""Milliseconds after the solution."""

_LAST = 2**31 - 1
"""Place among the objects of a document behind all others."""

_LEFT, _HEIGHT = 190.0, 26.0
"""How far left of the component lists stand, and how far from one to the next, in pixels."""


def offer_lists(component: Any, cache: ComponentCache, lists: Mapping[str, Sequence[str]]) -> None:
    """Have lists made for a component that was just placed.

    Parameters
    ----------
    component : IGH_Component
    cache : ComponentCache
        Of the component, which remembers that lists were made.
    lists : mapping of str to sequence of str
        What each input takes, the default first.
    """
    document = component.OnPingDocument()
    is_wired = any(parameter.SourceCount > 0 for parameter in component.Params.Input)
    if not lists or cache.has_lists or is_wired or not hasattr(document, "ScheduleSolution"):
        return
    cache.has_lists = True
    delegate: Any = import_module("Grasshopper.Kernel").GH_Document.GH_ScheduleDelegate
    document.ScheduleSolution(_DELAY, delegate(lambda place: _add_lists(place, component, lists)))


def _add_lists(document: Any, component: Any, lists: Mapping[str, Sequence[str]]) -> None:
    special: Any = import_module("Grasshopper.Kernel.Special")
    point: Any = import_module("System.Drawing").PointF
    bounds = component.Attributes.Bounds
    for i, (name, values) in enumerate(lists.items()):
        parameter = next(one for one in component.Params.Input if one.Name == name)
        made = special.GH_ValueList()
        made.CreateAttributes()
        made.NickName = name
        made.ListItems.Clear()
        for value in values:
            made.ListItems.Add(special.GH_ValueListItem(value, f'"{value}"'))
        made.SelectItem(0)
        made.Attributes.Pivot = point(bounds.Left - _LEFT, bounds.Bottom + _HEIGHT * i)
        document.AddObject(made, False, _LAST)
        parameter.AddSource(made)
    component.ExpireSolution(False)
