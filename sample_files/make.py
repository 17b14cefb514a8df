"""Write the sample files of this folder: ``python sample_files/make.py [NAME ...]``.

Each holds one triangle mesh, named and on a layer, in millimetres.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import rhino3dm

import shapes

HERE = Path(__file__).resolve().parent
LAYERS = {
    "narrow_neck": "Neck",
    "six_way_joint": "Joint",
    "minimal_surface": "Minimal surface",
    "hemisphere": "Dome",
    "hourglass": "Hourglass",
    "handle": "Handle",
    "closed_body": "Body",
    "shell_2400x1600": "Shell",
}


def write(name: str, layer_name: str, vertices: shapes.Array, faces: shapes.Index) -> None:
    """Write one mesh; the ids are made from the name, so that the same mesh gives the same ids."""
    mesh = rhino3dm.Mesh()
    for vertex in vertices.tolist():
        mesh.Vertices.AddPoint3d(*vertex)
    for face in faces.tolist():
        mesh.Faces.AddFace(*face)
    mesh.Normals.ComputeNormals()
    mesh.Compact()

    model = rhino3dm.File3dm()
    model.ApplicationName = "weavecore sample files"
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Settings.ModelAbsoluteTolerance = 0.01
    layer = rhino3dm.Layer()
    layer.Name = layer_name
    layer.Color = (90, 130, 180, 255)
    layer.Id = uuid5(NAMESPACE_URL, f"weavecore:layer:{name}")
    attributes = rhino3dm.ObjectAttributes()
    attributes.LayerIndex = model.Layers.Add(layer)
    attributes.Name = name
    attributes.Id = uuid5(NAMESPACE_URL, f"weavecore:object:{name}")
    model.Objects.AddMesh(mesh, attributes)
    if not model.Write(f"{name}.3dm", 7):
        raise OSError(f"{name}.3dm could not be written")


def main(names: list[str]) -> None:
    """Write the named samples, or all."""
    os.chdir(HERE)  # rhino3dm writes the path that it is given into the file
    for name in names or LAYERS:
        vertices, faces = getattr(shapes, name)()
        write(name, LAYERS[name], vertices, faces)
        print(f"{name}.3dm: {len(faces)} faces, {Path(f'{name}.3dm').stat().st_size // 1024} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
