"""Mesh files: .obj, .ply, .off and .stl.

Polygons stay polygons, but for .stl, which holds triangles and single precision only.
"""

from __future__ import annotations

import numpy as np

from weavecore.exporting.product import Polygons, Product, coordinate_lines, faces_to_write
from weavecore.geometry.polygon_mesh import fan_triangles


def encode_obj(product: Product) -> bytes:
    """Wavefront OBJ: text, every bit of the coordinates kept."""
    mesh = faces_to_write(product, ".obj")
    lines = coordinate_lines(mesh.points, "v ") + [f"f {row}" for row in mesh.rows(" ", first=1)]
    return _text([f"# weavecore, unit: {product.surface.unit}", *lines])


def encode_off(product: Product) -> bytes:
    """Object File Format: text, every bit of the coordinates kept."""
    mesh = faces_to_write(product, ".off")
    faces = [f"{sides} {row}" for sides, row in zip(np.diff(mesh.offsets).tolist(), mesh.rows(" "))]
    return _text(["OFF", f"{len(mesh.points)} {mesh.n_faces} 0", *coordinate_lines(mesh.points), *faces])


def encode_ply(product: Product) -> bytes:
    """Polygon File Format: binary, little-endian, double precision."""
    mesh = faces_to_write(product, ".ply")
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
    # Each face is its number of corners, then these: the counts go in before every first corner.
    faces = np.insert(mesh.corners, mesh.offsets[:-1], np.diff(mesh.offsets)).astype("<i4")
    return _text(header) + mesh.points.astype("<f8").tobytes() + faces.tobytes()


def encode_stl(product: Product) -> bytes:
    """Binary STL: triangles with their normals, single precision, no unit."""
    mesh: Polygons = faces_to_write(product, ".stl")
    corners = mesh.points[fan_triangles(mesh.offsets, mesh.corners)[0]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    record["corners"] = corners
    return b"weavecore".ljust(80) + len(corners).to_bytes(4, "little") + record.tobytes()


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()
