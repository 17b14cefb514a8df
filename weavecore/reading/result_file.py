"""The JSON result, read back to the last value of the stage that wrote it.

Nothing in the file is believed: every index is checked against what it names and every number for being finite,
before either is used.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn, Union

import numpy as np

from weavecore.errors import Unreadable, Unsupported
from weavecore.files import PathLike
from weavecore.model import FAMILIES, Bands, Latitudes, Lattice, Polylines, SurfaceMesh, Weave
from weavecore.reading.result_origins import take_origins
from weavecore.reading.result_part import ResultPart, damaged_result
from weavecore.reading.result_weave import take_weave

FORMAT, VERSION = "weavecore", 1

Result = Union[SurfaceMesh, Latitudes, Lattice, Weave]


def read_result(path: PathLike) -> Result:
    """Read a JSON result: what was exported is returned, value for value.

    Parameters
    ----------
    path : path
        What ``export`` or ``weavecore weave --json`` wrote.

    Returns
    -------
    SurfaceMesh, Latitudes, Lattice or Weave
        The last stage that the file has.

    Raises
    ------
    Unreadable
        Where the file is missing, is no JSON, breaks off or contradicts itself.
    Unsupported
        Where it is no result of weavecore, or of a later version.
    BadIndex, NonFinite, Degenerate, NonManifold
    """
    return decode_result(_read_bytes(path))


def read_weave(path: PathLike) -> tuple[Weave, bytes]:
    """Read a JSON result that has a weave, and give the bytes of the file with it.

    Raises
    ------
    Unsupported
        Where the file has no weave; else as `read_result`.
    """
    content = _read_bytes(path)
    weave = decode_result(content)
    if not isinstance(weave, Weave):
        raise Unsupported(
            f"{path} has no rods", remedy="Give what `weavecore weave INPUT --json RESULT.json` wrote, with a weave."
        )
    return weave, content


def decode_result(data: bytes) -> Result:
    """The result that the bytes of a JSON file hold; see `read_result`."""
    return take_result(_parse(data))


def take_result(values: object) -> Result:
    """The result in the values of a JSON file that has been parsed; see `read_result`."""
    document = ResultPart(values)
    if "format" not in document or document.text("format") != FORMAT:
        raise Unsupported(
            "The file is no result of weavecore", remedy="Give what `weavecore weave INPUT --json RESULT.json` wrote."
        )
    if document.number("version") != VERSION:
        raise Unsupported(
            f"The result is of version {document.number('version'):g}, and {VERSION} is read",
            remedy="Weave again with this version of weavecore.",
        )
    surface = _surface(document)
    if "latitudes" not in document:
        return surface
    latitudes = _latitudes(document, surface)
    if "lattice" not in document:
        return latitudes
    lattice = _lattice(document, latitudes)
    return take_weave(document, lattice) if "weave" in document else lattice


def _parse(data: bytes) -> Any:
    try:
        return json.loads(data.decode("utf-8-sig"), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        detail = "too deep" if isinstance(error, RecursionError) else str(error)
        raise Unreadable(
            f"The file is no JSON that can be read: {detail}", remedy="The file is damaged: weave again."
        ) from None


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


def _surface(document: ResultPart) -> SurfaceMesh:
    part = document.part("surface")
    vertices = part.floats("vertices", (-1, 3))
    offsets, values = part.rows("cut", len(vertices)) if "cut" in part else (np.zeros(1, np.int64), None)
    cuts = () if values is None else tuple(np.split(values, offsets[1:-1]))
    return SurfaceMesh(
        vertices,
        part.indices("faces", (-1, 3), len(vertices)),
        unit=document.text("unit"),
        tolerance=document.number("tolerance", least=0.0),
        cuts=cuts,
        name=part.text("name"),
        mendings=tuple(part.texts("mendings")),
        starts=take_origins(part, len(vertices)) if "origins" in part else None,
    )


def _latitudes(document: ResultPart, surface: SurfaceMesh) -> Latitudes:
    part = document.part("latitudes")
    points = part.floats("points", (-1, 3))
    offsets = part.offsets("offsets", len(points))
    n, m = len(offsets) - 1, len(points)
    # Results from before polylines could be open do not say that they are closed.
    closed = part.flags("closed", n) if "closed" in part else np.ones(n, bool)
    if (np.diff(offsets) < np.where(closed, 3, 2)).any():
        raise damaged_result("latitudes.offsets has a polyline of too few points: three if closed, else two")
    return Latitudes(
        surface=surface,
        polylines=Polylines(
            points,
            offsets,
            closed,
            part.indices("face", (m,), surface.n_faces),
            part.floats("barycentric", (m, 3)),
        ),
        generation=part.indices("generation", (n,), max(n, 1)),
        distance=part.floats("distance", (n,)),
        parents=part.indices("parents", (-1, 2), n),
        bands=_bands(part.part("bands"), n),
        spacing=_positive(document, "spacing"),
        vertex_distance=part.floats("vertex_distance", (surface.n_vertices,)),
    )


def _bands(part: ResultPart, n_polylines: int) -> Bands:
    polyline = part.indices("polyline", (-1,), n_polylines)
    offsets = part.offsets("offsets", len(polyline))
    n = len(offsets) - 1
    return Bands(
        offsets,
        polyline,
        part.flags("is_parent", len(polyline)),
        part.flags("is_left", len(polyline)),
        # The Euler characteristic of a piece with borders is 1 at most, and may be as low as there are handles.
        part.indices("euler", (n,), 3, least=-(2**40)),
        part.floats("depth", (n,)),
    )


def _lattice(document: ResultPart, latitudes: Latitudes) -> Lattice:
    part = document.part("lattice")
    nodes = part.floats("nodes", (-1, 3))
    n = len(nodes)
    face_offsets, face_nodes = part.rows("faces", n)
    edges = part.indices("edges", (-1, 2), n)
    family = part.names("edge_family", FAMILIES)
    if len(family) != len(edges):
        raise damaged_result(f"lattice.edge_family has {len(family)} entries for {len(edges)} edges")
    return Lattice(
        latitudes=latitudes,
        nodes=nodes,
        face_offsets=face_offsets,
        face_nodes=face_nodes,
        edges=edges,
        edge_family=family,
        node_latitude=part.indices("node_latitude", (n,), len(latitudes), least=-1),
        node_station=part.floats("node_station", (n,)),
        pattern=document.part("parameters").text("pattern"),
        edge_length=_positive(document, "edge_length"),
        off_latitudes="off_latitudes" in part and part.flag("off_latitudes"),
    )


def _positive(document: ResultPart, key: str) -> float:
    return document.part("parameters").number(key, least=float(np.finfo(float).tiny))


def _read_bytes(path: PathLike) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise Unreadable(
            f"{path} could not be read: {error.strerror or error}", remedy="Look at the name and at the file's rights."
        ) from error
