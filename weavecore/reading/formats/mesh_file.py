"""Mesh files: .obj, .off, .ply, .stl, each read by its own reader, none of which guesses.

The readers take the bytes of the file and give a `RawMesh` in the numbering of the file, so that what is
wrong can be named as the user knows it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Callable

from weavecore.errors import NoSurface, TooMuchWork, Unreadable, WeaveError
from weavecore.files import PathLike
from weavecore.reading.formats.obj import read_obj
from weavecore.reading.formats.off import read_off
from weavecore.reading.formats.ply import read_ply
from weavecore.reading.formats.stl import read_stl
from weavecore.reading.raw import RawMesh

MESH_READERS: Mapping[str, Callable[[bytes], RawMesh]] = MappingProxyType(
    {".obj": read_obj, ".off": read_off, ".ply": read_ply, ".stl": read_stl}
)
MOST_BYTES = 1 << 30
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def read_mesh_file(path: PathLike) -> RawMesh:
    """Read a mesh file by its ending.

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork, BadIndex, NoSurface
    """
    file = Path(path)
    data = read_bytes(path)
    data = data[3:] if data.startswith(_BYTE_ORDER_MARK) else data
    try:
        raw = MESH_READERS[file.suffix.lower()](data)
    except WeaveError:
        raise
    except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
        raise Unreadable(f"{path} is damaged ({error})", remedy="Export the file again.") from error
    if len(raw.faces) == 0:
        raise NoSurface(
            f"{file.name} has {len(raw.vertices)} vertices and no faces",
            remedy="Export the surface as a mesh with faces.",
        )
    return replace(raw, name=file.stem)


def read_bytes(path: PathLike) -> bytes:
    """All of a file.

    Raises
    ------
    Unreadable, TooMuchWork
    """
    check_file(path)
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise Unreadable(f"{path} cannot be read: {error.strerror}", remedy="Look at the file's rights.") from error


def check_file(path: PathLike) -> None:
    """Refuse what is missing, no file, empty or too large to be read.

    Raises
    ------
    Unreadable, TooMuchWork
    """
    file = Path(path)
    if not file.is_file():
        what = "is no file" if file.exists() else "does not exist"
        raise Unreadable(f"{path} {what}", remedy="Look at the name and the folder.")
    size = file.stat().st_size
    if size == 0:
        raise Unreadable(f"{path} is empty", remedy="Export the file again.")
    if size > MOST_BYTES:
        raise TooMuchWork(
            f"{path} has {size / 2**30:.1f} GB, and at most {MOST_BYTES >> 30} GB are read",
            remedy="Export the surface with fewer faces, or by itself.",
        )
