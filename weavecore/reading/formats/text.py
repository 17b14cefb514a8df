"""Numbers out of text files, all of a kind at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Unreadable
from weavecore.geometry.arrays import Floats, Ints


def to_floats(words: Sequence[bytes], what: str) -> Floats:
    """The words as float64; `Unreadable` where one is no number."""
    return _to(words, np.float64, what)


def to_ints(words: Sequence[bytes], what: str) -> Ints:
    """The words as int64; `Unreadable` where one is no whole number."""
    return _to(words, np.int64, what)


def to_points(lines: list[bytes], what: str) -> Floats:
    """The first three numbers of each line (N, 3)."""
    rows = [line.split(None, 3)[:3] for line in lines]
    if any(len(row) < 3 for row in rows):
        raise damaged(f"A {what} has less than three coordinates")
    return to_floats([word for row in rows for word in row], what).reshape(-1, 3)


def damaged(what: str) -> Unreadable:
    """The error of a file that breaks off or contradicts itself."""
    return Unreadable(what, remedy="The file is damaged: export it again.")


def _to(words: Sequence[bytes], dtype: Any, what: str) -> NDArray[Any]:
    try:
        return np.array(words, dtype=dtype)
    except (ValueError, OverflowError):
        raise damaged(f"A {what} holds something that is no number") from None
