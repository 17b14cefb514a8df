"""The writers, one a file ending, and the verb that finds the right one.

A writer is a function of a `Product` that gives the bytes of the file.  It touches no disk, so
that a file is either written whole or not at all.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Callable

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


def writer_for(path: PathLike) -> Writer:
    """The writer of the ending of ``path``, in whatever case.

    Raises
    ------
    Unsupported
        Where no writer has that ending.
    """
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise Unsupported(
            f"{path} has no ending that can be written", remedy=f"End the name with one of {', '.join(WRITERS)}."
        )
    return WRITERS[ending]


def encode(
    value: StageValue,
    path: PathLike,
    *,
    strands: Strands | None = None,
    parameters: Mapping[str, object] | None = None,
) -> bytes:
    """The bytes of the file that ``path`` names, by its ending.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes or Lattice
    path : path
        Only its ending counts.
    strands : Strands, optional
        The rods of a lattice, written with it.
    parameters : mapping, optional
        Options to be named in the file, besides those that the value knows.

    Raises
    ------
    Unsupported
        Where the ending is not known, or cannot hold this kind of value.
    """
    return writer_for(path)(product_of(value, strands=strands, parameters=parameters))
