"""The written files as the report reads them: columns of texts and numbers."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Floats, Ints


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Parameters
    ----------
    invariant : str
        What was measured.
    value, limit : float
        What was found, and the most that is right.
    ids : tuple of str
        What offends.
    """

    invariant: str
    value: float
    limit: float
    ids: tuple[str, ...] = ()

    @property
    def passes(self) -> bool:
        """Whether the value keeps to its limit (what is not a number does not)."""
        return bool(self.value <= self.limit)


def count(invariant: str, ids: Sequence[str]) -> Finding:
    """The finding that nothing offends: how many do."""
    unique = tuple(sorted(set(ids)))
    return Finding(invariant, float(len(unique)), 0.0, unique)


def worst(invariant: str, values: Floats, limit: float, ids: Sequence[str]) -> Finding:
    """The greatest of the values, and the ids of those beyond the limit; not a number counts as beyond."""
    if len(values) == 0:
        return Finding(invariant, 0.0, limit)
    over = np.flatnonzero(~(values <= limit))
    value = float("nan") if np.isnan(values).any() else float(values.max())
    return Finding(invariant, value, limit, tuple(sorted({ids[k] for k in over.tolist()})))


@dataclass(frozen=True)
class ReadTable:
    """A table as it was read back."""

    columns: Mapping[str, list[str]]

    def __getitem__(self, column: str) -> list[str]:
        return self.columns[column]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))

    def floats(self, column: str) -> Floats:
        """Numbers; not a number where a field is empty."""
        return np.array([float(text) if text else np.nan for text in self.columns[column]], np.float64)

    def lists(self, column: str) -> list[list[str]]:
        """The names in every field."""
        return [text.split() for text in self.columns[column]]


def read_table(content: bytes) -> ReadTable:
    """Read a CSV file of the folder."""
    lines = content.decode().splitlines()
    rows = list(csv.reader(io.StringIO("\n".join(line for line in lines if not line.startswith("#")))))
    return ReadTable({name: [row[k] for row in rows[1:]] for k, name in enumerate(rows[0])})


def statement_of(content: bytes) -> dict[str, str]:
    """What the first line of a file states: ``unit``, ``weave``, ``pattern``, ``input``…"""
    line = content.split(b"\n", 1)[0].decode().lstrip("# ")
    return {part.split(" ", 1)[0]: part.split(" ", 1)[1] for part in line.split("; ") if " " in part}


@dataclass(frozen=True)
class Folder:
    """All files of a folder."""

    files: Mapping[str, bytes]
    _read: dict[str, ReadTable] = field(default_factory=dict)

    def table(self, name: str) -> ReadTable:
        """A table, read once."""
        if name not in self._read:
            self._read[name] = read_table(self.files[f"{name}.csv"])
        return self._read[name]

    @cached_property
    def diameter(self) -> dict[str, float]:
        """Diameter of each rod."""
        rods = self.table("rods")
        return dict(zip(rods["rod_id"], rods.floats("diameter").tolist()))

    @cached_property
    def axes(self) -> Axes:
        """The points along the axes."""
        table = self.table("axes")
        columns = [table.floats(name) for name in ("x", "y", "z")]
        return Axes.of(
            table["rod_id"], table.floats("station"), np.stack(columns, axis=1), table.floats("layer_offset")
        )


@dataclass(frozen=True, eq=False)
class Axes:
    """Points along the axes, by rod: those of ``ids[k]`` are ``offsets[k]:offsets[k + 1]``."""

    ids: tuple[str, ...]
    offsets: Ints
    station: Floats
    point: Floats
    layer_offset: Floats

    @classmethod
    def of(cls, rods: list[str], station: Floats, point: Floats, layer_offset: Floats) -> Axes:
        """Group rows that stand together."""
        names = np.array(rods)
        starts = np.flatnonzero(np.append(True, names[1:] != names[:-1])) if len(names) else np.zeros(0, np.int64)
        offsets = np.append(starts, len(names)).astype(np.int64)
        return cls(tuple(names[starts].tolist()), offsets, station, point, layer_offset)

    def rod(self, k: int) -> slice:
        """The rows of a rod."""
        return slice(int(self.offsets[k]), int(self.offsets[k + 1]))

    @cached_property
    def rod_of(self) -> dict[str, int]:
        """The number of each rod."""
        return {name: k for k, name in enumerate(self.ids)}

    def rows_at(self, rods: Sequence[str], stations: Floats) -> Ints:
        """The row nearest to a station of a rod, for many."""
        reach = float(self.station.max(initial=0.0)) + 1.0
        key = np.repeat(np.arange(len(self.ids)), np.diff(self.offsets)) * reach + self.station
        wanted = np.array([self.rod_of[rod] for rod in rods], np.int64) * reach + stations
        after = np.clip(np.searchsorted(key, wanted), 1, len(key) - 1)
        nearest: Ints = np.where(np.abs(key[after - 1] - wanted) <= np.abs(key[after] - wanted), after - 1, after)
        return nearest
