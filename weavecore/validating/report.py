"""`Finding`, a figure with a limit, and `Report`, all findings about a value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from weavecore.errors import Broken

_MOST_IDS = 8
"""Ids shown for a finding; the finding has all of them."""


@dataclass(frozen=True)
class Finding:
    """One figure that must not exceed its limit.

    Parameters
    ----------
    name : str
        What was measured, words joined by underscores.
    figure : float
        The value; most figures count what is wrong.
    limit : float
        The greatest figure that holds.
    ids : tuple of int
        What is wrong, where the figure counts something.
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
        verdict = "ok  " if self.holds else "FAIL"
        line = f"{verdict} {self.name}: {self.figure:.6g} (limit {self.limit:.6g})"
        if self.holds or not self.ids:
            return line
        shown = ", ".join(map(str, self.ids[:_MOST_IDS])) + (", …" if len(self.ids) > _MOST_IDS else "")
        return f"{line}; {self.kind} {shown}"


def count(name: str, ids: ArrayLike, kind: str) -> Finding:
    """Count distinct ids, of which there should be none.

    Parameters
    ----------
    name : str
    ids : (n,) array_like of int
        What is wrong.
    kind : str
        What the ids are.
    """
    unique = np.unique(np.asarray(ids, np.int64))
    return Finding(name, float(len(unique)), 0.0, tuple(unique.tolist()), kind)


@dataclass(frozen=True)
class Report:
    """The findings about a value.

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
        """The findings beyond their limits."""
        return tuple(finding for finding in self.findings if not finding.holds)

    @property
    def holds(self) -> bool:
        """Whether every finding holds."""
        return not self.broken

    def raise_if_broken(self) -> None:
        """Raise `Broken`, with the ids of the first broken finding, unless all hold."""
        if self.holds:
            return
        first = self.broken[0]
        raise Broken(
            "; ".join(f"{f.name} is {f.figure:.6g}, limit {f.limit:.6g}" for f in self.broken),
            remedy="This is an error in weavecore: please report it with the input.",
            ids=first.ids,
            kind=first.kind,
        )

    def __str__(self) -> str:
        return "\n".join(map(str, self.findings))
