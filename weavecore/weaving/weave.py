"""Stage 4: from the lattice to the rods (Yan et al. 2016, §3 and §6).

1. Edges are paired into rods (`strands`), and these lie over and under each other (`layers`): the `layout`, which does
   not depend on the diameter.
2. Their axes are fitted (`axes`) and their bending is measured (`bending`).
3. Without a given diameter: the stock diameter is chosen (`stock`), rods that cannot be bent are broken (`breaks`), and
   both steps are done again with these.
4. Where rods end, the others are shifted further away, so that overhangs pass.
5. Overhangs that still clash are shortened (`overhangs`), the axes are drawn, and rods get their names (`naming`).

Without a rod diameter the search for the thickest stock diameter that can be bent begins at a part of the spacing.
Linear in the visits but for sorting; each diameter that is tried costs a fit of the axes.  After breaks rods are found
anew, and fitted anew near the nodes at which they differ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Callable, Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model.bending import Material
from weavecore.model.joints import Clashes, Joints
from weavecore.model.lattice import FAMILIES, LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.model.rod_axes import RodAxes
from weavecore.model.rod_ends import FEWEST_JOINTS
from weavecore.model.strands import Strands
from weavecore.model.weave import Weave
from weavecore.weaving.axes import Fit, draw_axes, fit_axes, nodes_around, refit_axes, usual_overhangs
from weavecore.weaving.bending import Sharpest, find_sharpest, measure_bending
from weavecore.weaving.bent_rods import BentRods
from weavecore.weaving.breaks import break_strands, find_breaks
from weavecore.weaving.clash_work import check_work
from weavecore.weaving.largest_diameters import largest_at, least_largest
from weavecore.weaving.layers import STACKED, Order, order_rods
from weavecore.weaving.layout import Layout, check_layout, lay_out_rods
from weavecore.weaving.materials import material_named
from weavecore.weaving.naming import find_lean, name_strands
from weavecore.weaving.overhangs import clear_overhangs
from weavecore.weaving.stock import LEAST_RODS, LEAST_SHARE, MOST_SHORT, choose_diameter, next_thinner, stock_diameters
from weavecore.weaving.strands import darts_at, families_along, find_strands, steps_along

_MOST_BREAK_ROUNDS = 3
"""A break takes the bend out of the spans beside it and may leave the next ones sharp: further rounds find them."""

_FEWEST_OF_ALL = 2
"""Joints of a piece at least, in the last round: a rod too sharply bent is broken even where that gives short rods, for
one that snaps is worse."""

_MOST_SHARP = 0.5
"""Share of the joints at which the thinnest rods of the stock may be too sharply bent to be broken there.  Beyond it,
broken rods would be pieces of a few joints each, and hold nothing: they stay whole, and exceed the allowable stress."""

_MOST_OVERHANG_ROUNDS = 6
"""Rounds in which the room for overhangs is taken back at contacts of rods that it bends too much."""

_NO_WORSE = 1e-3
"""A rod that exceeds the allowable stress may be bent so much more sharply, in parts, for the overhangs of others."""

Progress = Optional[Callable[[float, str], None]]


def weave_lattice(
    lattice: Lattice,
    *,
    rod_diameter: Union[float, Mapping[str, float], None] = None,
    stock: Optional[Sequence[float]] = None,
    material: Union[str, Material] = "gfrp",
    over_under: Optional[str] = None,
    layout: Optional[Layout] = None,
    progress: Progress = None,
) -> Weave:
    """Lay rods over and under each other along the edges of a lattice.

    Parameters
    ----------
    lattice : Lattice
    rod_diameter : float or mapping, optional
        In the model's unit; one for all rods, or one for each family: ``{"latitudinal": 3.0, "longitudinal": 2.0}``,
        where those of a ``"pocket"`` are as the longitudinal ones if they are not named.  By default the thickest
        stock diameter with which nearly all rods can be bent to their places (`weavecore.weaving.stock`).
    stock : sequence of float, optional
        Diameters to choose from, in the model's unit; by default those in which the material is sold.
    material : str or Material
        A name in the table of materials, or one of your own.
    over_under : str, optional
        ``"stacked"``: in layers that rods do not leave; ``"plain"``: over, under, over…;
        ``"twill 2/2"`` or others: over two, under two.  By default what the lattice's pattern is woven in.
    layout : Layout, optional
        From `lay_out_rods` with the same lattice and style, where it is known; the weave is the same without.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Weave

    Raises
    ------
    Unsupported
        Where a diameter is not positive or a family has none, both a diameter and a stock are given, the material
        or style is not known, or the layout is another one's.
    TooMuchWork
        Where the rods are too thin or too thick to be compared with each other.
    """
    report = progress or (lambda _fraction, _label: None)
    by_family = None if rod_diameter is None else _by_family(rod_diameter)
    if stock is not None:
        stock = _checked_stock(stock, by_family)
    stuff = material if isinstance(material, Material) else material_named(material)
    report(0.0, "finding the strands")
    if layout is None:
        layout = lay_out_rods(lattice, over_under)
    check_layout(layout, lattice, over_under)
    weaver = _Weaver(layout, stuff)
    report(0.3, "bending the rods")
    bent = weaver.bend_in_stock(stock) if by_family is None else weaver.bend(layout.strands, by_family)
    bent = weaver.make_room_for_overhangs(bent)
    report(0.8, "measuring")
    axes, clashes = _with_overhangs(lattice, bent.strands, bent.fit, bent.rods.diameters)
    is_whole = bent.strands is layout.strands
    return Weave(
        lattice=lattice,
        strands=bent.strands,
        ids=layout.ids if is_whole else name_strands(bent.strands, lattice, bent.lean),
        joints=bent.order.joints,
        axes=axes,
        normals=bent.fit.normals,
        bending=measure_bending(axes, bent.rods, bent.sharpest),
        diameters=bent.rods.diameters,
        material=stuff,
        over_under=layout.style.name,
        conflicts=bent.order.conflicts,
        clashes=clashes,
    )


def move_nodes(weave: Weave, nodes: Floats) -> Weave:
    """The same rods in the same layers through nodes that are moved a little.

    Parameters
    ----------
    weave : Weave
    nodes : (N, 3) float64

    Returns
    -------
    Weave
        Its lattice counts as off the latitudes.
    """
    lattice = replace(weave.lattice, nodes=nodes, off_latitudes=True)
    strands, diameters, axes = weave.strands, weave.diameters, weave.axes
    fit = refit_axes(lattice, strands, weave.joints, diameters, layer_offsets=axes.layer_offsets, normals=weave.normals)
    axes, clashes = _with_overhangs(lattice, strands, fit, diameters)
    rods = _rods_of(fit, strands, diameters, weave.material)
    bending = measure_bending(axes, rods, find_sharpest(rods))
    return replace(weave, lattice=lattice, axes=axes, normals=fit.normals, bending=bending, clashes=clashes)


def _with_overhangs(lattice: Lattice, strands: Strands, fit: Fit, diameters: Floats) -> tuple[RodAxes, Clashes]:
    """The axes of a fit with their overhangs, those that clash shortened."""
    longest = usual_overhangs(strands, fit, diameters)
    overhangs, clashes = clear_overhangs(fit.points, fit.rows, strands, longest, diameters)
    return draw_axes(lattice, strands, fit, overhangs), clashes


def _rods_of(fit: Fit, strands: Strands, diameters: Floats, material: Material) -> BentRods:
    """The rods of a fit, as they are bent."""
    shift = fit.layer_offsets[:, None] * fit.normals[strands.nodes]
    return BentRods(fit.points, fit.rows, shift, strands.offsets, strands.closed, diameters, material)


@dataclass(frozen=True, eq=False)
class _Bent:
    """Rods in their places: diameters (3,) by family, the splines, and how sharply they are bent.

    ``cuts`` (k, 2) are the darts between which rods are broken.
    """

    strands: Strands
    lean: Ints
    order: Order
    by_family: Floats
    fit: Fit
    rods: BentRods
    sharpest: Sharpest
    cuts: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int64))

    @property
    def n_short(self) -> int:
        """Count of rods with fewer than `FEWEST_JOINTS` joints."""
        return int(np.count_nonzero(np.bincount(self.order.joints.strand, minlength=len(self.strands)) < FEWEST_JOINTS))


@dataclass(frozen=True, eq=False)
class _Weaver:
    """Bends the rods of a layout into their places, of one material."""

    layout: Layout
    material: Material

    @property
    def lattice(self) -> Lattice:
        """That the rods run along."""
        return self.layout.lattice

    def bend(
        self,
        strands: Strands,
        by_family: Floats,
        like: Optional[_Bent] = None,
        counts_overhangs: Optional[Bools] = None,
    ) -> _Bent:
        """Lay rods of diameters (3,) by their family over and under each other and measure how they are bent.

        The fit starts from that of ``like`` rods: those of another diameter, or before they are broken.  With the same
        diameters it is renewed only near the nodes at which rods differ.  Overhangs count at the contacts (C,) of
        ``counts_overhangs``, by default at none.
        """
        lattice = self.lattice
        diameters = _of_rods(by_family, strands)
        for size in np.unique(diameters).tolist():
            check_work(float(lattice.edge_lengths.sum()), lattice.n_edges, lattice.latitudes.surface.area, size)
        layout = self.layout
        if strands is layout.strands:
            lean, order = layout.lean, layout.order
        elif like is not None and strands is like.strands:
            lean, order = like.lean, like.order
        else:
            lean = find_lean(strands, lattice, layout.slants)
            order = order_rods(lattice, strands, lean, layout.style)
        n_contacts = len(order.joints.contacts)
        if counts_overhangs is None:
            counts_overhangs = np.zeros(n_contacts, bool)
        start, changed = (np.ones(n_contacts), layout.normals), None
        if like is not None:
            start = (_shift_ratios(order.joints, like), like.fit.normals)
            if np.array_equal(by_family, like.by_family):
                same = _same_visits(lattice, strands, order.joints, like)
                changed = _changed_nodes(lattice, strands, order.joints, same, counts_overhangs)
        fit = fit_axes(
            lattice,
            strands,
            order.joints,
            diameters,
            layout.outward,
            centred_on_rings=layout.style.name == STACKED,
            counts_overhangs=counts_overhangs,
            start=start,
            changed=changed,
        )
        rods = _rods_of(fit, strands, diameters, self.material)
        return _Bent(strands, lean, order, by_family, fit, rods, find_sharpest(rods))

    def bend_in_stock(self, own: Optional[Sequence[float]]) -> _Bent:
        """Rods of the thickest stock diameter that nearly all can be bent in, broken where few cannot."""
        stock = own or stock_diameters(self.material.name, self.lattice.latitudes.surface.unit)
        strands = self.layout.strands
        whole = self.bend(strands, _one_for_all(self.lattice.assumed_diameter))
        diameter = choose_diameter(least_largest(whole.rods, 1.0 - LEAST_SHARE), stock)
        while True:
            whole = self.bend(strands, _one_for_all(diameter), like=whole)
            bent = self.break_rods(whole, FEWEST_JOINTS)
            thinner = next_thinner(diameter, stock)
            if thinner is None and (whole.sharpest.at_visits > 1.0).mean() > _MOST_SHARP:
                return whole
            if thinner is None or (bent.sharpest.utilisation <= 1.0).mean() >= LEAST_RODS:
                broken = self.break_rods(bent, _FEWEST_OF_ALL)
                if thinner is None or broken.n_short - whole.n_short <= MOST_SHORT * len(broken.strands):
                    return broken
            diameter = thinner

    def break_rods(self, bent: _Bent, fewest: int) -> _Bent:
        """Break rods where they are bent too sharply, as far as no piece gets fewer joints.

        First the rods are found anew without the sharp turns, so that others may take over the ways of the pieces.
        """
        for found_anew in (True, False):
            for _ in range(_MOST_BREAK_ROUNDS):
                largest = largest_at(bent.rods, bent.sharpest.at_visits > 1.0)
                breaks = find_breaks(bent.strands, largest, bent.rods.diameters, fewest=fewest)
                if not breaks.any():
                    return bent
                cuts = np.concatenate([bent.cuts, darts_at(self.lattice, bent.strands, breaks)])
                if found_anew:
                    strands = find_strands(self.lattice, cuts, self.layout.pairs)
                else:
                    strands = break_strands(bent.strands, breaks)
                    # A piece may run along a ring alone.
                    strands = replace(strands, family=families_along(strands, self.lattice))
                bent = replace(self.bend(strands, bent.by_family, like=bent), cuts=cuts)
        return bent

    def make_room_for_overhangs(self, bent: _Bent) -> _Bent:
        """Shift rods apart where one ends, so that its overhang passes the other, unless that bends one too much."""
        joints, strands = bent.order.joints, bent.strands
        node = joints.node[joints.joint[joints.contacts[:, 0]]]
        counts_overhangs = np.ones(len(joints.contacts), bool)
        for n in range(_MOST_OVERHANG_ROUNDS):
            wider = self.bend(strands, bent.by_family, like=bent, counts_overhangs=counts_overhangs)
            before, now = bent.sharpest.utilisation, wider.sharpest.utilisation
            is_worse = (now > 1.0) & ((before <= 1.0) | (now > (1.0 + _NO_WORSE) * before))
            if not is_worse.any():
                return wider
            # What is shifted at a joint shifts all of its rods, and those beside it a little.
            nodes = np.zeros(self.lattice.n_nodes, bool)
            nodes[strands.nodes[is_worse[strands.owner]]] = True
            counts_overhangs &= ~nodes_around(strands, nodes, n)[node]
        return bent


def _shift_ratios(joints: Joints, like: _Bent) -> Floats:
    """Shift ratios (C,) of contacts as those of like rods; 1 at nodes that they pass another number of times."""
    before = like.order.joints
    if joints is before:
        return like.fit.shift_ratios
    if len(before) == 0:
        return np.ones(len(joints.contacts))
    at = np.minimum(np.searchsorted(before.node, joints.node), len(before) - 1)
    n_new, n_old = np.diff(joints.offsets), np.diff(before.offsets)
    is_same = (before.node[at] == joints.node) & (n_old[at] == n_new)
    joint = joints.joint[joints.contacts[:, 0]]
    first = np.cumsum(n_old - 1) - (n_old - 1)
    ratios = np.ones(len(joint))
    known = is_same[joint]
    ratios[known] = like.fit.shift_ratios[(first[at][joint] + joints.rank[joints.contacts[:, 0]])[known]]
    return ratios


def _same_visits(lattice: Lattice, strands: Strands, joints: Joints, like: _Bent) -> Ints:
    """The visit (M,) of like rods between the same two nodes, at the same height of a stack as high, or -1."""
    if strands is like.strands:
        return np.arange(len(strands.nodes))
    now, before = _visit_rows(strands, joints), _visit_rows(like.strands, like.order.joints)
    if len(before) == 0:
        return np.full(len(now), -1)
    # A rod runs along each edge once, so a node and one beside it name a visit.
    code, known = (rows[:, 0] * (lattice.n_nodes + 1) + rows[:, 1] for rows in (now, before))
    order = np.argsort(known)
    found = order[np.minimum(np.searchsorted(known[order], code), len(known) - 1)]
    same: Ints = np.where((before[found] == now).all(axis=1), found, -1)
    return same


def _visit_rows(strands: Strands, joints: Joints) -> Ints:
    """(M, 6) node, the greater and the lesser node beside it (-1 beyond an end), height, rods there, whether a ring."""
    nodes = strands.nodes
    before, after = steps_along(strands)
    beside = np.full((len(nodes), 2), -1)
    beside[after, 0], beside[before, 1] = nodes[before], nodes[after]
    stack = np.zeros((len(nodes), 2), np.int64)
    stack[joints.visit] = np.stack([joints.rank, np.diff(joints.offsets)[joints.joint]], axis=1)
    is_ring = np.repeat(strands.family == LATITUDINAL, np.diff(strands.offsets))
    return np.column_stack([nodes, beside.max(axis=1), beside.min(axis=1), stack, is_ring])


def _changed_nodes(lattice: Lattice, strands: Strands, joints: Joints, same: Ints, counts_overhangs: Bools) -> Bools:
    """Nodes (N,) at which a visit is not the ``same`` as before, or the overhang of a rod that ends there counts."""
    changed = np.zeros(lattice.n_nodes, bool)
    changed[strands.nodes[same < 0]] = True
    is_end = np.zeros(len(strands.nodes), bool)
    is_end[strands.offsets[:-1][~strands.closed]] = is_end[strands.offsets[1:][~strands.closed] - 1] = True
    has_end = is_end[joints.visit[joints.contacts]].any(axis=1)
    changed[joints.node[joints.joint[joints.contacts[has_end & counts_overhangs, 0]]]] = True
    return changed


def _one_for_all(diameter: float) -> Floats:
    """The same diameter (3,) for every family."""
    return np.full(len(FAMILIES), diameter)


def _by_family(rod_diameter: Union[float, Mapping[str, float]]) -> Floats:
    """Diameter (3,) of each family, NaN where none is given."""
    if not isinstance(rod_diameter, Mapping):
        rod_diameter = dict.fromkeys(FAMILIES, rod_diameter)
    found = _one_for_all(np.nan)
    for name, value in rod_diameter.items():
        if name not in FAMILIES:
            raise Unsupported(f"Unknown family of rods {name!r}", remedy=f"Use one of: {', '.join(FAMILIES)}.")
        size = float(value)
        if not (np.isfinite(size) and size > 0):
            raise Unsupported(f"The rod diameter must be positive (got {size:g})", remedy="Give a positive diameter.")
        found[FAMILIES.index(name)] = size
    if np.isnan(found[POCKET]):
        found[POCKET] = found[LONGITUDINAL]
    return found


def _of_rods(by_family: Floats, strands: Strands) -> Floats:
    """Diameter (S,) of each rod."""
    missing = np.unique(strands.family[np.isnan(by_family[strands.family])])
    if len(missing):
        names = " and ".join(FAMILIES[family] for family in missing.tolist())
        raise Unsupported(f"There are {names} rods, but no diameter for them", remedy=f"Give one for: {names}.")
    diameters: Floats = by_family[strands.family]
    return diameters


def _checked_stock(stock: Sequence[float], by_family: Optional[Floats]) -> tuple[float, ...]:
    """The diameters to choose from, rising."""
    sizes = tuple(sorted(float(size) for size in stock))
    if by_family is not None:
        raise Unsupported("A rod diameter leaves nothing to choose from a stock", remedy="Give one of the two.")
    if not sizes or not all(np.isfinite(size) and size > 0 for size in sizes):
        raise Unsupported(f"Stock diameters must be positive (got {sizes})", remedy="Give positive diameters.")
    return sizes
