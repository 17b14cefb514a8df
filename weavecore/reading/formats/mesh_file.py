"""Mesh files by ending: .obj, .off, .ply, .stl.

Each format has a reader that takes the bytes of the file and gives a `RawMesh` in the numbering of the file, so that
errors name faces and vertices as the user knows them.  None of them guesses: a file that contradicts itself is
refused.  trimesh reads these formats too, but takes many damaged files for valid or empty meshes, splits polygons of
more than four corners without regard to concave corners, and its errors have no types that separate a damaged file
from a fault.
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
from weavecore.texts import printable

MESH_READERS: Mapping[str, Callable[[bytes], RawMesh]] = MappingProxyType(
    {".obj": read_obj, ".off": read_off, ".ply": read_ply, ".stl": read_stl}
)
"""The reader of each ending."""

_TEXT_ONLY = (".obj", ".off")
"""Endings of files that are text; an archive named so may hold lines that look like faces."""

MOST_BYTES = 1 << 30
"""Largest file that is read, 1 GB: some 20 million faces, and several times that in memory."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""UTF-8 mark that some programs put before the text."""


def read_mesh_file(path: PathLike) -> RawMesh:
    """Read a mesh file by its ending.

    Parameters
    ----------
    path : path
        Ends with one of `MESH_READERS`, in upper or lower case.

    Returns
    -------
    RawMesh
        Named after the file.

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork, BadIndex, NoSurface
    """
    file = Path(path)
    data = read_bytes(path)
    data = data[3:] if data.startswith(_BYTE_ORDER_MARK) else data
    if file.suffix.lower() in _TEXT_ONLY and b"\0" in data:
        raise Unreadable(
            f"{path} is not a text file: it begins with {data[:4]!r}",
            remedy="Export the surface as a mesh again; take it out of its archive, or give it the ending it had.",
        )
    try:
        raw = MESH_READERS[file.suffix.lower()](data)
    except WeaveError:
        raise
    except MemoryError as error:
        raise TooMuchWork(
            f"The memory does not suffice to read {path}", remedy="Export the surface with fewer faces, or by itself."
        ) from error
    except (ArithmeticError, ValueError) as error:
        raise Unreadable(f"{path} is damaged ({error})", remedy="Export the file again.") from error
    if len(raw.faces) == 0:
        raise NoSurface(
            f"{file.name} has {len(raw.vertices)} vertices and no faces",
            remedy="Export the surface as a mesh with faces.",
        )
    return replace(raw, name=printable(file.stem))


def read_bytes(path: PathLike) -> bytes:
    """All bytes of a file.

    Parameters
    ----------
    path : path

    Returns
    -------
    bytes

    Raises
    ------
    Unreadable, TooMuchWork
    """
    check_file(path)
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise Unreadable(f"{path} cannot be read: {error.strerror}", remedy="Check the file permissions.") from error


def check_file(path: PathLike) -> None:
    """Refuse a path that is missing, not a file, empty or too large.

    Parameters
    ----------
    path : path

    Raises
    ------
    Unreadable, TooMuchWork
    """
    file = Path(path)
    if not file.is_file():
        what = "is not a file" if file.exists() else "does not exist"
        raise Unreadable(f"{path} {what}", remedy="Check the path.")
    size = file.stat().st_size
    if size == 0:
        raise Unreadable(f"{path} is empty", remedy="Export the file again.")
    if size > MOST_BYTES:
        raise TooMuchWork(
            f"{path} has {size / 2**30:.1f} GB, more than the limit of {MOST_BYTES >> 30} GB",
            remedy="Export the surface with fewer faces, or by itself.",
        )
