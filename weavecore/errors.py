"""The errors of weavecore: one base, a class for each kind, each with a stable code.

An error states what is wrong, where (the offending ids) and how to mend it.  Every kind also derives from the builtin
exception that fits, so that ``except ValueError`` works as well.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

_MOST_IDS_SHOWN = 8
"""Ids that a message lists; with more it counts them."""


class WeaveError(Exception):
    """Base of all errors that weavecore raises on purpose.

    Parameters
    ----------
    what : str
        One sentence: what is wrong, and where.
    remedy : str
        One sentence: how to mend it.
    ids : iterable, optional
        The offending faces, vertices, object ids or layer names.
    kind : str, optional
        What the ids are: ``"face"``, ``"vertex"``, ``"object"``, ``"layer"``…
    points : iterable of (x, y, z), optional
        Where: the two ends of each offending edge, one edge after the other.
    """

    code: ClassVar[str] = "WEAVE_ERROR"

    def __init__(
        self, what: str, *, remedy: str, ids: Iterable[object] = (), kind: str = "", points: Iterable[Any] = ()
    ) -> None:
        self.points = tuple(points)
        self.what = what
        self.remedy = remedy
        self.ids = tuple(ids)
        self.kind = kind
        super().__init__(self._message())

    def _message(self) -> str:
        shown = ", ".join(str(i) for i in self.ids[:_MOST_IDS_SHOWN])
        if len(self.ids) > _MOST_IDS_SHOWN:
            shown += f", … ({len(self.ids)} in all)"
        where = f" ({self.kind} {shown})".replace("( ", "(") if shown else ""
        return f"{self.code}: {self.what.rstrip('.')}{where}. {self.remedy}"


class NotOrientable(WeaveError, ValueError):
    """The faces cannot be oriented consistently (a Moebius strip)."""

    code = "NOT_ORIENTABLE"


class NonManifold(WeaveError, ValueError):
    """Three faces on an edge, or two fans of faces that touch in one vertex."""

    code = "NON_MANIFOLD"


class NonFinite(WeaveError, ValueError):
    """A coordinate is NaN or infinite."""

    code = "NON_FINITE"


class BadIndex(WeaveError, IndexError):
    """A face names a vertex that does not exist."""

    code = "BAD_INDEX"


class Degenerate(WeaveError, ValueError):
    """Nothing with an area is left of the surface, or it is too thin to weave."""

    code = "DEGENERATE"


class NoSurface(WeaveError, LookupError):
    """The file has no surface, or none by the layer or name that was asked for."""

    code = "NO_SURFACE"


class AmbiguousSurface(WeaveError, LookupError):
    """Several objects could be meant; the ids list them."""

    code = "AMBIGUOUS_SURFACE"


class BadCurve(WeaveError, ValueError):
    """Distances cannot start at a curve: it lies off the surface, crosses itself, or has no length."""

    code = "BAD_CURVE"


class NoCurve(WeaveError, LookupError):
    """The file has no curve by the name that was asked for, or several of one that must be the only one."""

    code = "NO_CURVE"


class SpacingTooLarge(WeaveError, ValueError):
    """The spacing is larger than what the surface can hold."""

    code = "SPACING_TOO_LARGE"


class TooMuchWork(WeaveError, ValueError):
    """The result would be too large to compute; estimated before anything is allocated."""

    code = "TOO_MUCH_WORK"


class TooFarFromOrigin(WeaveError, ValueError):
    """The surface is so far from the origin that its coordinates have lost its shape."""

    code = "TOO_FAR_FROM_ORIGIN"


class Unreadable(WeaveError, OSError):
    """The file is missing, damaged or not of the format that its ending says."""

    code = "UNREADABLE"


class Unsupported(WeaveError, ValueError):
    """The format, the kind of object or the option is not one that weavecore knows."""

    code = "UNSUPPORTED"


class OutputExists(WeaveError, FileExistsError):
    """The output is there already and was not to be replaced."""

    code = "EXISTS"


class NotWritten(WeaveError, OSError):
    """The output could not be written; what was there before is whole."""

    code = "NOT_WRITTEN"


class Doubtful(WeaveError, ValueError):
    """The input or the result has notes of doubts, and doubts were to be refused."""

    code = "DOUBTFUL"


class Broken(WeaveError, ValueError):
    """A result breaks an invariant that it promises; `weavecore.validate` found it."""

    code = "BROKEN"


class NotConverged(WeaveError, ArithmeticError):
    """No equilibrium was found; ``reached`` is the state at which the search ended."""

    code = "NOT_CONVERGED"

    def __init__(self, what: str, *, remedy: str, reached: object = None) -> None:
        super().__init__(what, remedy=remedy)
        self.reached = reached


class UnitUnknown(UserWarning):
    """The file states no unit: lengths are taken as they are."""

    code = "UNIT_UNKNOWN"
