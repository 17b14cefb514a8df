"""What is cached between the solutions of a definition: results by their inputs, and which buttons are down.

Everything lies in ``scriptcontext.sticky``, in one cache for each component.  A cache holds the results of the last
two solutions, and at least `_FEWEST`: a slider that is set back costs no time, and memory does not grow with its steps.
The caches of a document that is closed, and of a component that is deleted, are dropped when the next new cache is
made and when a document is closed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, MutableMapping
from importlib import import_module
from typing import Any, Callable, Optional

_FEWEST, _SOLUTIONS = 4, 2
"""Results that a cache holds at least, and the solutions whose results it holds."""

_PREFIX = "weavecore:"
_WATCHED = "weavecore.watched"
"""Key of the sticky that says that the closing of documents is listened to."""


class ComponentCache:
    """Results of one component, of which the least recently used give way, and its buttons.

    Parameters
    ----------
    document : object, optional
        The definition that the component is in.
    guid : str
        Of the component.
    """

    def __init__(self, document: Any, guid: str) -> None:
        self.document, self.guid = document, guid
        self.down: set[str] = set()
        self.pressed: set[str] = set()
        self.has_lists = False
        self._outcomes: OrderedDict[str, Any] = OrderedDict()
        self._parts: OrderedDict[str, Any] = OrderedDict()

    def __len__(self) -> int:
        return len(self._outcomes)

    def get(self, key: Optional[str]) -> Any:
        """The result of these inputs, or None."""
        if key is None or key not in self._outcomes:
            return None
        self._outcomes.move_to_end(key)
        return self._outcomes[key]

    def put(self, key: Optional[str], outcome: Any, n_runs: int) -> None:
        """Keep a result of a solution of so many runs; none of inputs that cannot be told apart."""
        if key is None:
            return
        self._outcomes[key] = outcome
        _drop_oldest(self._outcomes, n_runs)

    def part(self, key: str, make: Callable[[], Any], n_runs: int) -> Any:
        """What several results have in common, made unless it is known."""
        if key not in self._parts:
            self._parts[key] = make()
        self._parts.move_to_end(key)
        _drop_oldest(self._parts, n_runs)
        return self._parts[key]


def _drop_oldest(kept: OrderedDict[str, Any], n_runs: int) -> None:
    while len(kept) > max(_FEWEST, _SOLUTIONS * n_runs):
        kept.popitem(last=False)


def cache_of(component: Any, sticky: MutableMapping[str, Any]) -> ComponentCache:
    """The cache of a component; where a new one is made, those that nobody needs are dropped.

    Parameters
    ----------
    component : IGH_Component
    sticky : mapping
    """
    document, guid = component.OnPingDocument(), str(component.InstanceGuid)
    # A definition that is opened twice, or saved under another name, has the same components.
    name = f"{_PREFIX}{getattr(document, 'DocumentID', '')}:{guid}"
    if name not in sticky:
        drop_caches(sticky)
        _watch_documents(sticky)
        sticky[name] = ComponentCache(document, guid)
    cache: ComponentCache = sticky[name]
    return cache


def drop_caches(sticky: MutableMapping[str, Any], closed: Any = None) -> None:
    """Drop the caches of components that are in no open document.

    Parameters
    ----------
    sticky : mapping
    closed : GH_Document, optional
        A document that is being closed.
    """
    server = _document_server()
    if server is None:
        return
    open_ids = {str(document.DocumentID) for document in server}
    if closed is not None:
        open_ids.discard(str(closed.DocumentID))
    for name in [name for name, cache in sticky.items() if isinstance(cache, ComponentCache)]:
        document = sticky[name].document
        if document is None:  # It is not on a canvas.
            continue
        is_open = str(document.DocumentID) in open_ids
        if not is_open or not _holds(document, sticky[name].guid):
            del sticky[name]


def _holds(document: Any, guid: str) -> bool:
    return any(str(one.InstanceGuid) == guid for one in document.Objects)


def _watch_documents(sticky: MutableMapping[str, Any]) -> None:
    """Have the caches of a document dropped when it is closed."""
    server = _document_server()
    if server is None or _WATCHED in sticky:
        return

    def closed(_sender: Any, document: Any) -> None:
        drop_caches(sticky, document)

    server.DocumentRemoved += closed
    sticky[_WATCHED] = closed


def _document_server() -> Any:
    """Grasshopper's open documents; None where there is no Grasshopper with a canvas."""
    try:
        instances = import_module("Grasshopper").Instances
    except (ImportError, AttributeError):
        return None
    return instances.DocumentServer


def runs_of(component: Any) -> tuple[int, int]:
    """Which run of the solution this is, from 0, and how many there will be.

    Parameters
    ----------
    component : IGH_Component
    """
    number = max(int(getattr(component, "RunCount", 1)) - 1, 0)
    counts = [_runs_at(parameter) for parameter in component.Params.Input]
    return number, max([number + 1, *counts])


def _runs_at(parameter: Any) -> int:
    """How many runs the data of an input make: one an item, or one a branch where it takes lists."""
    data, access = getattr(parameter, "VolatileData", None), str(getattr(parameter, "Access", "tree")).lower()
    if data is None or access not in ("item", "list"):
        return 1
    return int(data.DataCount if access == "item" else data.PathCount)


def pressed(
    component: Any, sticky: MutableMapping[str, Any], buttons: Mapping[str, Any], number: int
) -> dict[str, bool]:
    """Which buttons have turned true since the last solution.

    Parameters
    ----------
    component : IGH_Component
    sticky : mapping
    buttons : mapping of str to bool or None
    number : int
        Which run of the solution it is.  All runs of one solution see the same.
    """
    if not buttons:
        return {}
    cache = cache_of(component, sticky)
    if number == 0:
        down = {name for name, value in buttons.items() if value}
        cache.pressed, cache.down = down - cache.down, down
    return {name: name in cache.pressed for name in buttons}
