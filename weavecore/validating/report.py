"""`Report`: what was checked, what was found, and what may be at most."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from weavecore.errors import Broken


@dataclass(frozen=True)
class Finding:
    """One figure that must not exceed its limit.

    Parameters
    ----------
    name : str
        What was measured, in words joined by underscores.
    figure : float
        What was found; most figures count what is wrong.
    limit : float
        The largest figure that holds.
    ids : tuple of int
        What offends, where the figure counts something.
    kind : str
        What the ids are: ``"polyline"``, ``"face"``, ``"node"``…
    """

    name: str
    figure: float
    limit: float = 0.0
    ids: tuple[int, ...] = ()
    kind: str = ""

    @property
    def holds(self) -> bool:
        """Whether the figure keeps to its limit (a NaN does not)."""
        return bool(self.figure <= self.limit)

    def __str__(self) -> str:
        sign = "ok    " if self.holds else "BROKEN"
        line = f"{sign} {self.name}: {self.figure:.6g} (at most {self.limit:.6g})"
        if self.holds or not self.ids:
            return line
        shown = ", ".join(map(str, self.ids[:8])) + (", …" if len(self.ids) > 8 else "")
        return f"{line}; {self.kind} {shown}"


def count(name: str, ids: ArrayLike, kind: str) -> Finding:
    """The finding that nothing offends: how many distinct ``ids`` do."""
    unique = np.unique(np.asarray(ids, np.int64))
    return Finding(name, float(len(unique)), 0.0, tuple(unique.tolist()), kind)


@dataclass(frozen=True)
class Report:
    """What a check of a value found.

    Parameters
    ----------
    findings : tuple of Finding
    """

    findings: tuple[Finding, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "findings", tuple(self.findings))

    @classmethod
    def of(cls, *parts: Iterable[Finding]) -> Report:
        """One report of several checks."""
        return cls(tuple(finding for part in parts for finding in part))

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __getitem__(self, name: str) -> Finding:
        """Return the finding of that name."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(name)

    @property
    def broken(self) -> tuple[Finding, ...]:
        """The findings that do not hold."""
        return tuple(finding for finding in self.findings if not finding.holds)

    @property
    def holds(self) -> bool:
        """Whether every finding holds."""
        return not self.broken

    def raise_if_broken(self) -> None:
        """Raise `Broken` with the first finding's ids where something does not hold."""
        if self.holds:
            return
        first = self.broken[0]
        raise Broken(
            "; ".join(f"{f.name} is {f.figure:.6g}, at most {f.limit:.6g} holds" for f in self.broken),
            remedy="A stage gave a result that breaks its own promises: please report it with the input.",
            ids=first.ids,
            kind=first.kind,
        )

    def __str__(self) -> str:
        return "\n".join(map(str, self.findings))
