"""Weave the variants of one group and measure them: the work that a worker process does.

The offset is computed once for the group and the lattice once for each pattern.  An error ends its variant only: it
stands in the result, with the figures that were known by then.  Nothing here touches the disk: what a worker on another
machine returns is written by the process that explores.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Optional, Union

import numpy as np

from weavecore import pipeline
from weavecore.errors import TooMuchWork, Unsupported, WeaveError
from weavecore.exploring.variants import Group, Variant
from weavecore.exporting.registry import encode
from weavecore.fabricating.needs import estimate_needs
from weavecore.fabricating.workshop import Workshop
from weavecore.model import Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.model.rod_ends import FEWEST_JOINTS
from weavecore.units import METRES, millimetres_in
from weavecore.viewing.picture import encode_picture

Figure = Union[int, float, None]

RODS, METRES_OF_ROD, MASS, ENDS, STUBS = "rods", "length (m)", "mass (kg)", "ends inside", "stubs"
BEND, RADIUS, DIAMETER = "rods that bend (%)", "least radius / allowed", "diameter"
CONFLICTS, CLASHES, JOINTS, TIES, WASTE = "conflicts", "clashes", "joints", "ties", "waste (%)"
DEPARTURE_MEAN, DEPARTURE_MAX, STRESS = "mean departure", "greatest departure", "stress / allowed at rest"

FIGURES = (
    RODS, METRES_OF_ROD, MASS, ENDS, STUBS, BEND, RADIUS, DIAMETER, CONFLICTS, CLASHES, JOINTS, TIES, WASTE,
)  # fmt: skip
SIMULATED = (DEPARTURE_MEAN, DEPARTURE_MAX, STRESS)
"""Figures of a simulated variant besides."""

PICTURE_SIZE = (480, 360)
"""Pixels of a picture: wide enough for the page's largest view of it, and about 60 kB."""

_DIGITS = 6
"""Significant digits of a figure: more than a design is chosen by, and free of the last bits of a sum."""

_LOST_MEMORY = "TOO_MUCH_WORK: the memory did not suffice. Choose a larger spacing or a coarser mesh."


@dataclass(frozen=True)
class Result:
    """What became of a variant.

    Parameters
    ----------
    key : str
        Of the variant.
    figures : mapping of str to number or None
        By the names of `FIGURES`, and of `SIMULATED` where it was simulated; empty where nothing was woven.
    error : str
        Code, what is wrong and a remedy; empty where all went well.
    is_final : bool
        Whether the same variant gives the same again; False where time or memory ran out, or a worker was lost.
    picture, page : bytes or None
        PNG and HTML.
    seconds : float
        Time that it took; the first of a group with that of the offset, the first of a pattern with that of linking.
    """

    key: str
    figures: Mapping[str, Figure] = field(default_factory=dict)
    error: str = ""
    is_final: bool = True
    picture: Optional[bytes] = None
    page: Optional[bytes] = None
    seconds: float = 0.0


class _TimeOver(TooMuchWork):
    """A variant takes longer than it may."""


class _Clock:
    """A progress callback that ends a variant when its time is over; the stages call it in all long loops."""

    def __init__(self, seconds: Optional[float]) -> None:
        self._seconds = seconds
        self._ends = math.inf if seconds is None else time.monotonic() + seconds

    def __call__(self, _fraction: float, _label: str) -> None:
        if time.monotonic() > self._ends:
            raise _TimeOver(
                f"The variant takes longer than {self._seconds:.4g} seconds",
                remedy="Explore again with a larger time limit, or use a larger spacing.",
            )


def weave_group(
    surface: SurfaceMesh, group: Group, *, with_pages: bool, time_limit: Optional[float] = None
) -> list[Result]:
    """Weave the variants of a group; see the module.

    Parameters
    ----------
    surface : SurfaceMesh
    group : Group
    with_pages : bool
        Whether each variant gets a page of its own.
    time_limit : float, optional
        Seconds that a variant may take; one that takes longer gets an error and is tried again in the next run.

    Returns
    -------
    list of Result
        One for each variant, in their order.
    """
    stages = _SharedStages(surface)
    return [_weave_variant(stages, variant, with_pages, _Clock(time_limit)) for variant in group.variants]


class _SharedStages:
    """The latitudes of a group and the lattice of the last pattern, or the errors that they ended with."""

    def __init__(self, surface: SurfaceMesh) -> None:
        self._surface = surface
        self._known: dict[str, Any] = {}

    def lattice(self, variant: Variant, clock: _Clock) -> Lattice:
        if variant.pattern not in self._known:
            latitudes = self._once("", lambda: self._offset(variant, clock))
            self._known = {"": latitudes}
        lattice: Lattice = self._once(
            variant.pattern, lambda: pipeline.link(self._known[""], pattern=variant.pattern, progress=clock)
        )
        return lattice

    def _offset(self, variant: Variant, clock: _Clock) -> Latitudes:
        return pipeline.offset(self._surface, spacing=variant.spacing, borders=variant.borders, progress=clock)

    def _once(self, name: str, make: Callable[[], Any]) -> Any:
        if name not in self._known:
            try:
                self._known[name] = make()
            except WeaveError as error:
                self._known[name] = error
        if isinstance(self._known[name], WeaveError):
            raise self._known[name]
        return self._known[name]


def _weave_variant(stages: _SharedStages, variant: Variant, with_pages: bool, clock: _Clock) -> Result:
    begun = time.perf_counter()
    figures: dict[str, Figure] = {}
    files: dict[str, bytes] = {}
    error, is_final = "", True
    try:
        lattice = stages.lattice(variant, clock)
        weave = pipeline.weave(lattice, rod_diameter=variant.rod, material=variant.material, progress=clock)
        files["picture"] = encode_picture(weave, size=PICTURE_SIZE)
        if with_pages:
            files["page"] = encode(weave, "page.html")
        figures.update(measure_weave(weave))
        if variant.is_simulated:
            figures.update(_measure_rest(weave, clock))
    except WeaveError as caught:
        error, is_final = " ".join(str(caught).split()), not isinstance(caught, _TimeOver)
    except MemoryError:
        error, is_final = _LOST_MEMORY, False
    except Exception as caught:  # noqa: BLE001 - a fault in one variant must not end the others.
        error, is_final = f"INTERNAL: {type(caught).__name__}: {' '.join(str(caught).split())}", False
    seconds = time.perf_counter() - begun
    return Result(variant.key, figures, error, is_final, files.get("picture"), files.get("page"), seconds)


def measure_weave(weave: Weave) -> dict[str, Figure]:
    """The figures of a weave by their names.

    Parameters
    ----------
    weave : Weave

    Returns
    -------
    dict of str to number or None
        Rounded to six digits; None where the model has no unit, or the stock is too short for a rod.
    """
    bending, joints = weave.bending, weave.joints
    at_joint = np.zeros(len(weave.strands.nodes), np.int64)
    at_joint[joints.visit] = 1
    joints_of_rod = np.add.reduceat(at_joint, weave.strands.offsets[:-1]) if len(weave) else np.zeros(0, np.int64)
    utilisation = float(bending.utilisation.max(initial=0.0))
    needs = _needs(weave)
    found: dict[str, Figure] = {
        RODS: len(weave),
        METRES_OF_ROD: needs.metres if needs else None,
        MASS: needs.kilograms if needs else None,
        ENDS: weave.n_ends_inside,
        STUBS: int((joints_of_rod < FEWEST_JOINTS).sum()),
        BEND: 100.0 * float((bending.utilisation <= 1.0).mean()) if len(weave) else None,
        RADIUS: 1.0 / utilisation if utilisation > 0 else None,
        DIAMETER: weave.rod_diameter,
        CONFLICTS: len(weave.conflicts),
        CLASHES: len(weave.clashes),
        JOINTS: len(joints),
        TIES: len(joints.contacts),
        WASTE: 100.0 * needs.waste if needs else None,
    }
    return {name: _rounded(value) for name, value in found.items()}


def _needs(weave: Weave) -> Any:
    unit = weave.lattice.latitudes.surface.unit
    if unit not in METRES:
        return None
    try:
        return estimate_needs(weave, scale=millimetres_in(unit), workshop=Workshop(templates=()))
    except Unsupported:  # The stock is too short for a rod: it can be woven, but not cut.
        return None


def _measure_rest(weave: Weave, clock: _Clock) -> dict[str, Figure]:
    """How far the nodes depart where the rods come to rest, and how much of the allowable stress they use there."""
    supports = "borders" if weave.is_border_node.any() else "none"
    equilibrium = pipeline.simulate(weave, supports=supports, progress=clock)
    return {
        DEPARTURE_MEAN: _rounded(equilibrium.departure_mean),
        DEPARTURE_MAX: _rounded(equilibrium.departure_max),
        STRESS: _rounded(equilibrium.utilisation_max),
    }


def _rounded(value: Figure) -> Figure:
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
