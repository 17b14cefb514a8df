"""The writers of files, one for each file ending.

A writer is a function of a `Product` that returns the bytes of the file.  It touches no disk, so
that a file is either written whole or not at all.  `weavecore.pipeline` adds the writers of other
folders: pictures and pages.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Callable, Optional

from weavecore.errors import Unsupported
from weavecore.exporting.json_result import encode_json
from weavecore.exporting.mesh_files import encode_obj, encode_off, encode_ply, encode_stl
from weavecore.exporting.product import Product, StageValue, product_of
from weavecore.exporting.rhino_file import encode_3dm
from weavecore.files import PathLike
from weavecore.model import Strands

Writer = Callable[[Product], bytes]

WRITERS: dict[str, Writer] = {
    ".3dm": encode_3dm,
    ".json": encode_json,
    ".obj": encode_obj,
    ".ply": encode_ply,
    ".off": encode_off,
    ".stl": encode_stl,
}
"""The writer of each ending, in lower case with its dot."""


def register_writer(ending: str, writer: Writer) -> None:
    """Add the writer of a file ending, or replace it.

    Parameters
    ----------
    ending : str
        In lower case with its dot: ``".png"``.
    writer : callable
        Takes a `Product` and returns bytes.
    """
    WRITERS[ending] = writer


def writer_for(path: PathLike) -> Writer:
    """Find the writer for the ending of a path.

    Parameters
    ----------
    path : path
        Its ending may be in upper case.

    Returns
    -------
    callable

    Raises
    ------
    Unsupported
        Where no writer has that ending.
    """
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise Unsupported(
            f"{path} has no ending that can be written", remedy=f"Use one of the endings {', '.join(WRITERS)}."
        )
    return WRITERS[ending]


def encode(
    value: StageValue,
    path: PathLike,
    *,
    strands: Optional[Strands] = None,
    parameters: Optional[Mapping[str, object]] = None,
) -> bytes:
    """Write a stage's result in the format of a path's ending.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice or Weave
    path : path
        Only its ending counts.
    strands : Strands, optional
        The rods of a lattice, written with it.
    parameters : mapping, optional
        Options to be named in the file, besides those that the value has.

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        Where the ending is not known, or cannot hold this kind of value.
    """
    return writer_for(path)(product_of(value, strands=strands, parameters=parameters))
