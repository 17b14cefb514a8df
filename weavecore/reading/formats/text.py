"""Numbers in text files, converted all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Unreadable
from weavecore.geometry.arrays import Floats, Ints


def to_floats(words: Sequence[bytes], what: str) -> Floats:
    """Convert words to float64.

    Parameters
    ----------
    words : sequence of bytes
    what : str
        What the words belong to, for the error: "vertex", "face".

    Returns
    -------
    (n,) float64

    Raises
    ------
    Unreadable
        Where a word is not a number.
    """
    return _to(words, np.float64, what)


def to_ints(words: Sequence[bytes], what: str) -> Ints:
    """Convert words to int64.

    Parameters
    ----------
    words : sequence of bytes
    what : str
        What the words belong to, for the error: "vertex", "face".

    Returns
    -------
    (n,) int64

    Raises
    ------
    Unreadable
        Where a word is not a whole number.
    """
    return _to(words, np.int64, what)


def to_points(lines: list[bytes], what: str) -> Floats:
    """The first three numbers of each line.

    Parameters
    ----------
    lines : list of bytes
    what : str
        What a line is, for the error.

    Returns
    -------
    (N, 3) float64

    Raises
    ------
    Unreadable
    """
    rows = [line.split(None, 3)[:3] for line in lines]
    if any(len(row) < 3 for row in rows):
        raise damaged(f"A {what} has fewer than three coordinates")
    return to_floats([word for row in rows for word in row], what).reshape(-1, 3)


def damaged(what: str) -> Unreadable:
    """The error of a file that is truncated or contradicts itself.

    Parameters
    ----------
    what : str
        What is wrong, without a full stop.

    Returns
    -------
    Unreadable
    """
    return Unreadable(what, remedy="The file is damaged: export it again.")


def _to(words: Sequence[bytes], dtype: Any, what: str) -> NDArray[Any]:
    try:
        return np.array(words, dtype=dtype)
    except (ValueError, OverflowError):
        raise damaged(f"A {what} has an entry that is not a number") from None
