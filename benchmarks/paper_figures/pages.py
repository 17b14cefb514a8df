"""Words and tables for the pages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown; cells that are not text stand on the right.

    Columns that begin with ``<`` hold text.
    """
    sides = ["---" if name[:1] in ("", "<") else "---:" for name in columns]
    lines = [[name.lstrip("<") for name in columns], sides, *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def count(n: int, noun: str, nouns: str = "") -> str:
    """A number with its noun."""
    return f"{n} {noun if n == 1 else nouns or noun + 's'}"


def yes(flag: object) -> str:
    """A flag in words."""
    return "yes" if flag else "no"


def join(*parts: str) -> str:
    """Paragraphs, one after the other."""
    return "\n\n".join(parts)


def image(name: str, words: str) -> str:
    """A picture as wide as the page."""
    return f"![{words}](images/paper/{name}.png)"


def row_of_images(names: dict[str, str], width: int) -> str:
    """Pictures side by side, with their words, each so many percent of the page wide."""
    return " ".join(
        f'<img src="images/paper/{name}.png" width="{width}%" alt="{words}">' for name, words in names.items()
    )
