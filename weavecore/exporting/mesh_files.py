"""Mesh files: .obj, .ply, .off and .stl.

Polygons are kept, except in .stl, which holds triangles in single precision only.  Numbers in text files are the
shortest that read back to the same bits.
"""

from __future__ import annotations

import numpy as np

from weavecore.exporting.polygons import polygons_to_write
from weavecore.exporting.product import Product
from weavecore.geometry.arrays import Floats
from weavecore.geometry.polygon_mesh import fan_triangles

_STL_HEADER = 80
"""Bytes before the count of triangles."""


def encode_obj(product: Product) -> bytes:
    """Write Wavefront OBJ: text, coordinates exact.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        For latitudes, which are curves.
    """
    mesh = polygons_to_write(product, ".obj")
    lines = _coordinate_lines(mesh.points, "v ") + [f"f {row}" for row in mesh.rows(" ", first=1)]
    return _text([f"# weavecore, unit: {product.surface.unit}", *lines])


def encode_off(product: Product) -> bytes:
    """Write Object File Format: text, coordinates exact.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        For latitudes, which are curves.
    """
    mesh = polygons_to_write(product, ".off")
    faces = [f"{sides} {row}" for sides, row in zip(np.diff(mesh.offsets).tolist(), mesh.rows(" "))]
    return _text(["OFF", f"{len(mesh.points)} {mesh.n_faces} 0", *_coordinate_lines(mesh.points), *faces])


def encode_ply(product: Product) -> bytes:
    """Write Polygon File Format: binary, little-endian, double precision.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        For latitudes, which are curves.
    """
    mesh = polygons_to_write(product, ".ply")
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment weavecore, unit: {product.surface.unit}",
        f"element vertex {len(mesh.points)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {mesh.n_faces}",
        "property list int int vertex_indices",
        "end_header",
    ]
    # A face is the count of its corners, then the corners: the counts are inserted before every first corner.
    faces = np.insert(mesh.corners, mesh.offsets[:-1], np.diff(mesh.offsets)).astype("<i4")
    return _text(header) + mesh.points.astype("<f8").tobytes() + faces.tobytes()


def encode_stl(product: Product) -> bytes:
    """Write Binary STL: triangles with their normals, single precision, no unit.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        For latitudes, which are curves.
    """
    mesh = polygons_to_write(product, ".stl")
    corners = mesh.points[fan_triangles(mesh.offsets, mesh.corners)[0]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    record["corners"] = corners
    return b"weavecore".ljust(_STL_HEADER) + len(corners).to_bytes(4, "little") + record.tobytes()


def _coordinate_lines(points: Floats, prefix: str = "") -> list[str]:
    """One line for each point (n, 3)."""
    return [f"{prefix}{x!r} {y!r} {z!r}" for x, y, z in points.tolist()]


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()
