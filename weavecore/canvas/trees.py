"""Grasshopper's data trees: branches of items by paths of whole numbers."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any

from weavecore.polling import each

Branch = tuple[tuple[int, ...], list[Any]]
"""A path of a data tree and the items that lie there."""


def data_tree(branches: Iterable[Branch]) -> Any:
    """Make a ``DataTree`` of branches in their order; those of one path are put together.

    Parameters
    ----------
    branches : iterable of (path, items)
        A path is a tuple of whole numbers.

    Returns
    -------
    DataTree[Object]
    """
    grasshopper: Any = import_module("Grasshopper")
    paths: Any = import_module("Grasshopper.Kernel.Data")
    system: Any = import_module("System")
    # Python's own object is no type for .NET.
    tree = grasshopper.DataTree[system.Object]()
    for path, items in each(branches):
        place = paths.GH_Path(*path)
        tree.EnsurePath(place)
        for item in items:
            # A whole number would stay one of Python's, which Grasshopper does not reckon with.
            tree.Add(system.Int32(item) if isinstance(item, int) else item, place)
    return tree


def grouped(keys: Iterable[int], items: Iterable[Any]) -> list[Branch]:
    """Make one branch for each key, rising, with its items in their order.

    Parameters
    ----------
    keys, items : iterable
        A whole number for each item.

    Returns
    -------
    list of (path, items)
        The path of a branch is its key alone.
    """
    branches: dict[int, list[Any]] = {}
    for key, item in zip(keys, items):
        branches.setdefault(int(key), []).append(item)
    return [((key,), branches[key]) for key in sorted(branches)]
