""".NET arrays of points, faces and lines from and to NumPy, as blocks of memory.

A ``Point3d[]`` is three doubles after three doubles, so that a whole array can be copied at once while it is
pinned.  Where that is not so, or the garbage collector cannot pin it, the rows are taken one by one.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from operator import attrgetter
from typing import Any, Optional

import numpy as np
from numpy.typing import DTypeLike, NDArray


def rows_from(array: Any, names: Sequence[str], dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """The rows (n, len(names)) of a .NET array of structures, or of a list of objects with these attributes.

    Parameters
    ----------
    array : object
        Such as ``Point3d[]``, ``int[]`` or a list of rhino3dm points.
    names : sequence of str
        The fields of a structure in their order; a single empty name for plain numbers.
    dtype : dtype
        Of the fields: float64 for points, int32 for faces.
    """
    kind = np.dtype(dtype)
    block = _copy_block(array, len(names), kind)
    if block is not None:
        return block
    return np.array(_rows_one_by_one(array, names), kind).reshape(-1, len(names))


def net_array(element: Any, rows: NDArray[Any]) -> Any:
    """A .NET array of structures of a type, such as ``Point3d``, with these rows (n, fields).

    Where memory cannot be copied a structure is made of each row.
    """
    # The bridge to .NET is there wherever RhinoCommon is.
    clr, system = import_module("clr"), import_module("System")
    content = np.ascontiguousarray(rows)
    array = system.Array.CreateInstance(clr.GetClrType(element), len(content))
    with _pinned(array, content.itemsize * content.shape[1]) as address:
        if address is not None:
            ctypes.memmove(address, content.ctypes.data, content.nbytes)
            return array
    for i, row in enumerate(content.tolist()):
        array[i] = element(*row)
    return array


def _rows_one_by_one(array: Any, names: Sequence[str]) -> list[Any]:
    if list(names) == [""]:
        return list(array)
    return [*map(attrgetter(*names), array)]


def _copy_block(array: Any, n_fields: int, kind: np.dtype[Any]) -> Optional[NDArray[Any]]:
    """The rows of a .NET array, or None where they are no plain block of memory."""
    if not (hasattr(array, "GetType") and hasattr(array, "Length")):
        return None
    rows = np.empty((array.Length, n_fields), kind)
    with _pinned(array, kind.itemsize * n_fields) as address:
        if address is None:
            return None
        ctypes.memmove(rows.ctypes.data, address, rows.nbytes)
    return rows


@contextmanager
def _pinned(array: Any, size: int) -> Iterator[Optional[int]]:
    """The address of a .NET array that stays where it is meanwhile; None where its elements are not of that size."""
    interop: Any = import_module("System.Runtime.InteropServices")
    try:
        is_plain = interop.Marshal.SizeOf(array.GetType().GetElementType()) == size
        handle = interop.GCHandle.Alloc(array, interop.GCHandleType.Pinned) if is_plain else None
    except Exception:  # noqa: BLE001 - .NET says ArgumentException, which is no type that is known here.
        handle = None
    if handle is None:
        yield None
        return
    try:
        yield handle.AddrOfPinnedObject().ToInt64()
    finally:
        handle.Free()
