"""Supports that keep a weave where it was drawn: which nodes to hold so that none departs by more than a limit.

Marks alone cannot do it.  A weave of nearly inextensible rods moves by flexes, motions that stretch no rod.  Along a
flex ``v`` axial and tie forces do no work, so the drawn shape is in balance only where the bending energy is level::

    grad E_bend(x_drawn) . v = 0

whatever the rest lengths are.  Supports stop flexes.  They are chosen in a linear model about the weave on stiff
springs to the drawing (`weavecore.simulating.linearised`): the springs are made weaker from step to step, and at each
the nodes that depart most are held until all are within the limit and no eigenvalue is negative.  At the end the nodes
that the others make unnecessary are let go.  An equilibrium verifies the choice, and where nodes depart by more all the
same, those that depart most are held too.  The set is small, not proven to be the least.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Callable, Optional

import numpy as np

from weavecore.errors import NotConverged, Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model import Equilibrium, Weave
from weavecore.simulating.anchored import NearDrawing
from weavecore.simulating.boundary import Loads
from weavecore.simulating.linearised import LinearisedWeave
from weavecore.simulating.newton import find_equilibrium

Simulate = Callable[[Sequence[Floats], Floats], Equilibrium]
"""Comes to rest with the points given, each (1, 3), held, from a start (n, 3) near the equilibrium."""

STIFF = 1.0
"""Springs about which the weave is linearised, in ``EI / l^3`` of a median segment: every sample stays within a
millimetre of its drawing on them."""

WEAK = 1e-5
"""Springs that are left at the end: too weak to matter, but weaker ones let rods that are tied once drift."""

_SPRINGS = (1e-1, 1e-2, 1e-3, 1e-4, WEAK)
"""Weaker ones from step to step, at each of which nodes are held."""

MARGIN = 0.75
"""Of the limit: what is sought in the linear model."""

_APART = 0.25
"""Nodes of one round are this part of the bounding box's diagonal apart: nearer ones may move in the same flex."""

_MOST_ROUNDS = 20

_MOST_HELD = 250
"""Nodes that the linear model holds at most: a weave that needs more is better held at its borders."""


def nodes_to_hold(weave: Weave, limit: float, *, is_held: Bools, loads: Loads, metres: float) -> tuple[Ints, Floats]:
    """Few nodes to hold besides those that are held (N,), by a linear model; see the module.

    Parameters
    ----------
    weave : Weave
    limit : float
        Departure of a node that is allowed, in the model's unit.
    is_held : (N,) bool
    loads : Loads
    metres : float
        In one unit of the model.

    Returns
    -------
    nodes : (h,) int64
    points : (n, 3) float64
        Along the rods on stiff springs, in the model's unit: the equilibrium with these nodes held is near.
    """
    near = NearDrawing(weave, weave.axes.points * metres, metres)
    linear = linearised_on_springs(near, is_held, loads)
    return np.array(hold_in_model(linear, MARGIN * limit * metres), np.int64), linear.points / metres


def linearised_on_springs(near: NearDrawing, is_held: Bools, loads: Loads) -> LinearisedWeave:
    """The weave linear about its equilibrium on stiff springs."""
    structure = near.supported(is_held, loads)
    structure = structure.on_springs(near.springs(structure, STIFF))
    found = find_equilibrium(structure, near.at_anchors(structure, near.rods.points))
    return LinearisedWeave(near, structure, found.points)


def hold_in_model(linear: LinearisedWeave, limit: float) -> list[int]:
    """Hold nodes while the springs are made weaker, then let those go that the others make unnecessary."""
    for springs in _SPRINGS:
        linear.on_springs(springs)
        departure = linear.departure
        while (departure.max() > limit or linear.n_negative) and len(linear.held) < _MOST_HELD:
            departure[linear.held] = 0.0
            linear.hold(int(np.argmax(departure)))
            departure = linear.departure
    kept = np.ones(len(linear.held), bool)
    for k in range(len(kept)):
        kept[k] = False
        departure, n_negative = linear.without(kept)
        kept[k] = n_negative > 0 or departure.max() > limit
    linear.keep(kept)
    return linear.held


def hold_until_within(
    simulate: Simulate,
    limit: float,
    *,
    weave: Weave,
    released: Optional[Equilibrium],
    choose: Callable[[], tuple[Ints, Floats]],
) -> Equilibrium:
    """Hold nodes until none departs by more than a limit, and return that equilibrium.

    Parameters
    ----------
    simulate : callable
    limit : float
        In the model's unit.
    weave : Weave
    released : Equilibrium, optional
        Without supports, where it has an equilibrium.
    choose : callable
        Gives the nodes and points to begin with, as `nodes_to_hold` does.

    Raises
    ------
    Unsupported
        Where the limit is not positive.
    NotConverged
        Where so many rounds did not suffice; ``reached`` is the last equilibrium.
    """
    if not 0 < limit < np.inf:
        raise Unsupported(f"The limit of departure must be positive (got {limit:g})", remedy="Give a length.")
    if released is not None and released.departure_max <= limit:
        return released
    nodes, (held, start) = weave.lattice.nodes, choose()
    for _ in range(_MOST_ROUNDS):
        found = simulate([nodes[[n]] for n in held], start)
        if found.departure_max <= limit:
            return found
        held = np.concatenate([held, _worst(found, held, limit)])
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
    while left.max() > limit:
        chosen.append(int(np.argmax(left)))
        left[np.linalg.norm(nodes - nodes[chosen[-1]], axis=1) < apart] = 0.0
    return np.array(chosen, np.int64)
