"""The workshop folder as its checks read it back: `WrittenFolder`, and `CheckResult`, one line of the report.

The checks see the bytes of the files alone, never the values that these were made from, so that a mistake in writing
is found as well as one in computing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from weavecore.fabricating.csv_tables import ReadTable, read_table
from weavecore.fabricating.written_axes import WrittenAxes
from weavecore.geometry.arrays import Floats


@dataclass(frozen=True)
class CheckResult:
    """One line of the report.

    Parameters
    ----------
    invariant : str
        Name of what was measured, with its unit.
    value, limit : float
        What was found, and the greatest value that passes.
    ids : tuple of str
        The rods, pieces, joints… that break the limit.
    reason : str
        Of a note, which has no limit: why what it lists cannot be otherwise, or does no harm.
    """

    invariant: str
    value: float
    limit: float
    ids: tuple[str, ...] = ()
    reason: str = ""

    @property
    def passes(self) -> bool:
        """Whether the value keeps to its limit; NaN does not."""
        return bool(self.value <= self.limit)

    @property
    def is_note(self) -> bool:
        """Whether it lists something that the workshop should know and that is not wrong."""
        return self.limit == float("inf") and bool(self.ids)


def note_of(invariant: str, ids: Sequence[str], reason: str) -> CheckResult:
    """Count what the workshop should know, with the reason.

    Parameters
    ----------
    invariant : str
    ids : sequence of str
        Each counts once.
    reason : str
    """
    unique = tuple(sorted(set(ids)))
    return CheckResult(invariant, float(len(unique)), float("inf"), unique, reason)


def count_of(invariant: str, ids: Sequence[str]) -> CheckResult:
    """Check that nothing breaks an invariant.

    Parameters
    ----------
    invariant : str
    ids : sequence of str
        What breaks it; each counts once.
    """
    unique = tuple(sorted(set(ids)))
    return CheckResult(invariant, float(len(unique)), 0.0, unique)


def greatest_of(invariant: str, values: Floats, limit: float, ids: Sequence[str]) -> CheckResult:
    """Check the greatest of several values against a limit.

    Parameters
    ----------
    invariant : str
    values : (n,) float64
        NaN counts as beyond the limit.
    limit : float
    ids : sequence of str
        One for each value.
    """
    if len(values) == 0:
        return CheckResult(invariant, 0.0, limit)
    over = np.flatnonzero(~(values <= limit))
    value = float("nan") if np.isnan(values).any() else float(values.max())
    return CheckResult(invariant, value, limit, tuple(sorted({ids[k] for k in over.tolist()})))


@dataclass(frozen=True)
class WrittenFolder:
    """All files of a folder, with their tables read when they are first used.

    Parameters
    ----------
    files : mapping of file name to bytes
    """

    files: Mapping[str, bytes]
    _read: dict[str, ReadTable] = field(default_factory=dict)

    def table(self, name: str) -> ReadTable:
        """The table in ``name.csv``."""
        if name not in self._read:
            self._read[name] = read_table(self.files[f"{name}.csv"])
        return self._read[name]

    @cached_property
    def diameter(self) -> dict[str, float]:
        """Diameter of each rod in millimetres."""
        rods = self.table("rods")
        return dict(zip(rods["rod_id"], rods.floats("diameter").tolist()))

    @cached_property
    def axes(self) -> WrittenAxes:
        """The points along the axes."""
        table = self.table("axes")
        points = np.stack([table.floats(name) for name in ("x", "y", "z")], axis=1)
        rods = self.table("rods")
        closed = {rod for rod, state in zip(rods["rod_id"], rods["closed"]) if state == "yes"}
        return WrittenAxes.of(table["rod_id"], table.floats("station"), points, table.floats("layer_offset"), closed)

    @cached_property
    def joint_stations(self) -> dict[str, list[float]]:
        """The stations of the joints along each rod, rising."""
        marks = self.table("marks")
        found: dict[str, set[float]] = {}
        for rod, station, other in zip(marks["rod_id"], marks.floats("station").tolist(), marks["other_rod"]):
            if other:
                found.setdefault(rod, set()).add(station)
        return {rod: sorted(stations) for rod, stations in found.items()}
