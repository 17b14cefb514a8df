"""Words for what is reported."""

from __future__ import annotations

_PLURALS = {"vertex": "vertices"}


def counted(n: int, noun: str) -> str:
    """``1 face``, ``2,000 vertices``."""
    return f"{n:,} {noun if n == 1 else _PLURALS.get(noun, noun + 's')}"
