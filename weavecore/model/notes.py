"""`Note`: one thing that was changed, left out, guessed or doubted on the way from the input to the result.

A note has a code, like an error, and says how much and where.  *Changes* leave the shape as it is, or were asked for;
*hints* name an option that would give a better result; *doubts* say that the input may not be what it was meant to be,
or that the result may not be what is wanted: with ``--strict`` they are refused.  `NOTE_CODES` lists all codes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Union

import numpy as np
from numpy.typing import ArrayLike

from weavecore.geometry.arrays import Floats, frozen
from weavecore.texts import printable

NOTE_CODES: Mapping[str, str] = MappingProxyType(
    {
        "APART": "vertices in one place that stay apart, because parts touch only there",
        "COMPENSATED": "lengths and marks that allow for spring-back: the nodes lie where the weave rests",
        "CUT": "closed parts cut in two",
        "DROPPED": "faces or vertices left out: without area, repeated, or used by no face",
        "FILLED": "holes closed, as asked for or because they are far smaller than the spacing",
        "GRADED": "spacing factors that vary along a ring, which takes their mean",
        "JOINED": "objects joined to one surface",
        "LEFT_OUT": "parts left out as asked for",
        "PHASE": "the nearest spacing at which fewer rods would end where two fronts meet",
        "REPAIRED": "a repair of a result that an older version wrote",
        "REVERSED": "faces turned over, so that all are oriented alike",
        "SPLIT": "vertices shared by several fans of faces, split into one for each",
        "STITCHED": "vertices inserted into the edges of another border that they lie on",
        "TRIANGULATED": "faces with four or more corners split into triangles",
        "WELDED": "vertices in one place, or nearer to each other than the tolerance, made one",
        "BORDERS": "the mesh has another number of borders than the object",
        "COARSE": "the spacing exceeds the thickness or a fold's width; inverted faces; edges far off or too short",
        "COINCIDENT": "faces that lie on other faces",
        "CROSSING": "parts of the surface that pass through each other, or lie on each other beside a sharp fold",
        "FAR": "coordinates so far from the origin that their steps can be seen in the edges",
        "GAP": "borders that run close to each other, but not within the tolerance; faces apart from their edges",
        "SCRAPS": "pieces far smaller than the largest",
        "SLIT": "borders that enclose no area, or are far shorter than the longest",
        "SPRINGS_BACK": "a weave that departs from its drawing by more than was allowed, whatever its marks are",
        "THIN": "a solid that is thinner than the spacing: it is woven on both sides",
        "UNIT_UNKNOWN": "a Rhino file without a unit: lengths are used as they are",
        "UNUSED": "an option that had no effect",
    }
)
"""All codes, and what each says."""

DOUBTS = frozenset(
    {
        "BORDERS",
        "COARSE",
        "COINCIDENT",
        "CROSSING",
        "FAR",
        "GAP",
        "SCRAPS",
        "SLIT",
        "SPRINGS_BACK",
        "THIN",
        "UNIT_UNKNOWN",
        "UNUSED",
    }
)
"""Codes of doubts; the others are changes."""

MOST_POINTS = 8
"""Places that a note keeps; its count says how many there are."""


@dataclass(frozen=True)
class Note:
    """A change or a doubt.

    Parameters
    ----------
    code : str
        One of `NOTE_CODES`.
    text : str
        One sentence with the numbers and, of a doubt, what to do.
    numbers : mapping of str to float, or pairs
        Counts and lengths, in the model's unit; kept as pairs.
    points : (n, 3) array_like
        Where; the first `MOST_POINTS` are kept, as tuples.

    Raises
    ------
    ValueError
        Where the code is unknown or a point does not have three coordinates.
    """

    code: str
    text: str
    numbers: Union[Mapping[str, float], tuple[tuple[str, float], ...]] = ()
    points: ArrayLike = ()

    def __post_init__(self) -> None:
        if self.code not in NOTE_CODES:
            raise ValueError(f"no note has the code {self.code!r}")
        object.__setattr__(self, "text", printable(self.text))
        pairs = self.numbers.items() if isinstance(self.numbers, Mapping) else self.numbers
        object.__setattr__(self, "numbers", tuple((str(name), float(number)) for name, number in pairs))
        places = np.asarray(self.points, np.float64).reshape(-1, 3)[:MOST_POINTS]
        object.__setattr__(self, "points", tuple(tuple(place) for place in places.tolist()))

    @property
    def is_doubt(self) -> bool:
        """Whether ``--strict`` refuses it."""
        return self.code in DOUBTS

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False)
class InspectionMark:
    """A place to look at: a dot, or a curve.

    Parameters
    ----------
    kind : str
        ``"edges"`` that are bad, ``"gaps"``, ``"notes"`` or ``"borders"``.
    text : str
    points : (n, 3) float64
        One for a dot; of a curve as many as it has.
    """

    kind: str
    text: str
    points: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.float64, (-1, 3)))


def texts_of(notes: Iterable[Note]) -> tuple[str, ...]:
    """The sentences of notes.

    Parameters
    ----------
    notes : iterable of Note

    Returns
    -------
    tuple of str
    """
    return tuple(note.text for note in notes)


def at(point: ArrayLike) -> str:
    """A place as messages write it: ``(1, 2.5, 0)``.

    Parameters
    ----------
    point : (3,) array_like
    """
    x, y, z = (float(value) + 0.0 for value in np.asarray(point, np.float64))
    return f"({x:.6g}, {y:.6g}, {z:.6g})"
