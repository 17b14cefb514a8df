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
from weavecore.geometry.arrays import Floats, Ints


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
    """

    invariant: str
    value: float
    limit: float
    ids: tuple[str, ...] = ()

    @property
    def passes(self) -> bool:
        """Whether the value keeps to its limit; NaN does not."""
        return bool(self.value <= self.limit)


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
        columns = [table.floats(name) for name in ("x", "y", "z")]
        return WrittenAxes.of(
            table["rod_id"], table.floats("station"), np.stack(columns, axis=1), table.floats("layer_offset")
        )


@dataclass(frozen=True, eq=False)
class WrittenAxes:
    """Points along the axes, by rod and station; of a ring the first comes again at the end.

    Parameters
    ----------
    ids : tuple of str
        The R rods in the order of the file.
    offsets : (R+1,) int64
        The points of ``ids[k]`` are ``offsets[k]:offsets[k + 1]``.
    stations, layer_offsets : (n,) float64
    points : (n, 3) float64
    """

    ids: tuple[str, ...]
    offsets: Ints
    stations: Floats
    points: Floats
    layer_offsets: Floats

    @classmethod
    def of(cls, rods: list[str], stations: Floats, points: Floats, layer_offsets: Floats) -> WrittenAxes:
        """Group the rows (n) of ``axes.csv`` by the names of their rods."""
        names = np.array(rods)
        starts = np.flatnonzero(np.append(True, names[1:] != names[:-1])) if len(names) else np.zeros(0, np.int64)
        offsets = np.append(starts, len(names)).astype(np.int64)
        return cls(tuple(names[starts].tolist()), offsets, stations, points, layer_offsets)

    def rod(self, k: int) -> slice:
        """The rows of a rod."""
        return slice(int(self.offsets[k]), int(self.offsets[k + 1]))

    @cached_property
    def rod_of(self) -> dict[str, int]:
        """The index of each rod in ``ids``."""
        return {name: k for k, name in enumerate(self.ids)}

    def rows_at(self, rods: Sequence[str], stations: Floats) -> Ints:
        """(m,) the row nearest to the station of a rod, for m rods and stations."""
        # With a shift for each rod that is longer than all stations, the rows of all rods are one rising sequence.
        shift = float(self.stations.max(initial=0.0)) + 1.0
        key = np.repeat(np.arange(len(self.ids)), np.diff(self.offsets)) * shift + self.stations
        wanted = np.array([self.rod_of[rod] for rod in rods], np.int64) * shift + stations
        after = np.clip(np.searchsorted(key, wanted), 1, len(key) - 1)
        nearest: Ints = np.where(np.abs(key[after - 1] - wanted) <= np.abs(key[after] - wanted), after - 1, after)
        return nearest
