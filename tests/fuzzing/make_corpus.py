"""Make the corpus, small whole files of each format: ``python tests/fuzzing/make_corpus.py``.

The ids of objects in a ``.3dm`` are new each time; the other files come out as they are.
"""

# ruff: noqa: E402  a script: its folders are put on the path before its imports
from __future__ import annotations

import struct
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1])]

from weavecore import pipeline

CORPUS = HERE / "corpus"


def whole_files(reader: str, folder: Path) -> list[bytes]:
    """Files of a format that are in order."""
    if reader == "3dm":
        return _rhino_files(folder)
    points, faces = _sheet()
    text = {
        "obj": "".join(
            [*(f"v {x} {y} {z}\n" for x, y, z in points), *(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)]
        ),
        "off": f"OFF\n{len(points)} {len(faces)} 0\n"
        + "".join([*(f"{x} {y} {z}\n" for x, y, z in points), *(f"3 {a} {b} {c}\n" for a, b, c in faces)]),
        "ply": _ply_header(len(points), len(faces), "ascii")
        + "".join([*(f"{x} {y} {z}\n" for x, y, z in points), *(f"3 {a} {b} {c}\n" for a, b, c in faces)]),
        "stl": "solid sheet\n" + "".join(_facet(points[list(face)]) for face in faces) + "endsolid sheet\n",
    }[reader]
    files = [text.encode()]
    if reader == "ply":
        rows = b"".join(struct.pack("<B3i", 3, *face) for face in faces.tolist())
        files.append(
            _ply_header(len(points), len(faces), "binary_little_endian").encode()
            + points.astype("<f4").tobytes()
            + rows
        )
    if reader == "stl":
        rows = b"".join(
            struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel().tolist(), 0) for face in faces.tolist()
        )
        files.append(b"binary".ljust(80) + struct.pack("<I", len(faces)) + rows)
    return files


def _sheet(n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n)))
    points = np.column_stack([x, y, np.sin(x) * 0.3]).astype(float)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower, upper = (
        np.column_stack([corner, corner + 1, corner + n]),
        np.column_stack([corner + 1, corner + n + 1, corner + n]),
    )
    return points, np.vstack([lower, upper])


def _ply_header(n_points: int, n_faces: int, form: str) -> str:
    properties = "property float x\nproperty float y\nproperty float z\n"
    faces = f"element face {n_faces}\nproperty list uchar int vertex_indices\n"
    return f"ply\nformat {form} 1.0\nelement vertex {n_points}\n{properties}{faces}end_header\n"


def _facet(corners: np.ndarray) -> str:
    rows = "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners)
    return f"facet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\n"


def _rhino_files(folder: Path) -> list[bytes]:
    import rhino3dm

    import rhino_shapes as make

    points, faces = _sheet()
    mesh = rhino3dm.Mesh()
    for x, y, z in points.tolist():
        mesh.Vertices.Add(x, y, z)
    for a, b, c in faces.tolist():
        mesh.Faces.AddFace(a, b, c)
    files = []
    shapes = [mesh, make.can(), make.punched(), make.bowl(), make.saddle(), make.star()]
    for number, shape in enumerate(shapes):
        model = rhino3dm.File3dm()
        model.Objects.Add(shape, rhino3dm.ObjectAttributes())
        path = folder / f"whole{number}.3dm"
        model.Write(str(path), 5 + number % 4)
        files.append(path.read_bytes())
    return files


def _results() -> list[bytes]:
    """JSON results: a surface, and weaves of two patterns and of a surface that starts at a part of its borders."""
    points, faces = _sheet()
    surface = pipeline.surface_from((points * 100.0, faces), unit="Millimeters")
    latitudes = pipeline.offset(surface, spacing=140.0)
    weaves = [
        pipeline.weave(pipeline.link(latitudes), rod_diameter=2.0),
        pipeline.weave(pipeline.link(latitudes, pattern="kagome", edge_length=160.0), rod_diameter=2.0),
    ]
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for number, value in enumerate([surface, *weaves]):
            path = Path(folder) / f"result{number}.json"
            pipeline.export_together(value, [path])
            files.append(path.read_bytes())
    return files


def main() -> None:
    """Write the files."""
    for name in ("3dm", "obj", "ply", "stl", "off", "json"):
        folder = CORPUS / name
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch:
            files = _results() if name == "json" else whole_files(name, Path(scratch))
        for number, content in enumerate(files):
            (folder / f"whole{number}").write_bytes(content)


if __name__ == "__main__":
    main()
