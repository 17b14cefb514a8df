"""Supports that keep a weave where it was drawn: which nodes to hold so that none departs by more than a limit.

Marks alone cannot do it.  A weave of nearly inextensible rods moves by flexes, motions that stretch no rod.  Along a
flex ``v`` axial and tie forces do no work, so the drawn shape is in balance only where the bending energy is level::

    grad E_bend(x_drawn) . v = 0

whatever the rest lengths are.  Supports stop flexes.  They are chosen greedily: the weave comes to rest, the nodes that
depart most are held where they were drawn, no two of one round close together, and so on until all are within the
limit.  Each round costs one equilibrium.  The set is small, not proven to be the least.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Callable

import numpy as np

from weavecore.errors import NotConverged, Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.model import Equilibrium

Simulate = Callable[[Sequence[Floats]], Equilibrium]
"""Comes to rest with the points given, each (1, 3), held; released where there are none."""

_APART = 0.25
"""Nodes of one round are this part of the bounding box's diagonal apart: nearer ones may move in the same flex."""

_FIRST = 3
"""Fewest nodes that are held at once at first: fewer let the weave turn about them."""

_MOST_ROUNDS = 20


def hold_until_within(simulate: Simulate, limit: float, *, released: Equilibrium) -> Equilibrium:
    """Hold nodes until none departs by more than a limit, and return that equilibrium.

    Parameters
    ----------
    simulate : callable
    limit : float
        In the model's unit.
    released : Equilibrium
        Without supports.

    Raises
    ------
    Unsupported
        Where the limit is not positive.
    NotConverged
        Where so many rounds did not suffice; ``reached`` is the last equilibrium.
    """
    if not 0 < limit < np.inf:
        raise Unsupported(f"The limit of departure must be positive (got {limit:g})", remedy="Give a length.")
    found, held = released, np.zeros(0, np.int64)
    nodes = released.weave.lattice.nodes
    for _ in range(_MOST_ROUNDS):
        if found.departure_max <= limit:
            return found
        held = np.concatenate([held, _worst(found, held, limit)])
        found = simulate([nodes[[n]] for n in held])
    raise NotConverged(
        f"With {len(held)} nodes held, nodes still depart by {found.departure_max:.3g}",
        remedy="Hold the borders, or allow more.",
        reached=found,
    )


def _worst(found: Equilibrium, held: Ints, limit: float) -> Ints:
    """Nodes to hold next, those that depart most first."""
    nodes = found.weave.lattice.nodes
    apart = _APART * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    chosen: list[int] = []
    left = found.departure.copy()
    left[held] = 0.0
    while left.max() > (0.0 if len(held) == 0 and len(chosen) < _FIRST else limit):
        chosen.append(int(np.argmax(left)))
        left[np.linalg.norm(nodes - nodes[chosen[-1]], axis=1) < apart] = 0.0
    return np.array(chosen, np.int64)
