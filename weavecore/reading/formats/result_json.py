"""The JSON result, read back to the value of the last stage that wrote it.

Nothing in the file is trusted: `ResultPart` wraps each JSON object and checks every value when it is taken.  Values
that follow from others, as the points of rod axes from nodes and layer offsets, are computed again.  Linear in the
bytes.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, NoReturn, Union

import numpy as np

from weavecore.errors import TooMuchWork, Unreadable, Unsupported, WeaveError
from weavecore.files import PathLike
from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.splines import DEGREE, BSplineRows, b_spline_points, fit_splines
from weavecore.model import (
    FAMILIES,
    Bands,
    Bending,
    Clashes,
    Equilibrium,
    Joints,
    Latitudes,
    Lattice,
    Material,
    Note,
    Origins,
    Polylines,
    RodAxes,
    Strands,
    SurfaceMesh,
    Weave,
)
from weavecore.model.notes import NOTE_CODES
from weavecore.model.rod_axes import tip_parameters
from weavecore.reading.formats.result_part import ResultPart, damaged_result, with_arrays

FORMAT, VERSION = "weavecore", 1
"""What every result says of itself; `VERSION` rises when keys change their meaning."""


Result = Union[SurfaceMesh, Latitudes, Lattice, Weave, Equilibrium]

_TINY = float(np.finfo(float).tiny)
"""Least positive number: a length must not be 0."""


_FROM_NODE = 1e-6
"""An axis may miss the points of its strand by this part of the size of the lattice: far above rounding in JSON."""

MOST_BYTES = 1_000_000_000
"""Larger files are not looked at."""

_BYTES_OF = {b"{": 300, b"[": 72, b",": 48, b'"': 30}
"""Memory that an object, a list, an item and half a text take at most while the file is parsed, beside its bytes twice.
Lists of numbers become arrays as soon as they end, which leaves less than that."""

MOST_MEMORY = 4_000_000_000
"""Bytes: a weave of 100,000 nodes on a surface of three million faces may take 2.7 GB, and does take 2 GB."""

_ID = re.compile(r"[A-Za-z0-9_]{1,32}")
"""Ids stand in tables between blanks, and with ``-`` and a number in the names of pieces and splices."""

_STYLE = re.compile(r"stacked|plain|twill [1-9][0-9]?/[1-9][0-9]?")
_PATTERN = re.compile(r"[a-z]{1,32}")
_UNIT = re.compile(r"[A-Za-z]{0,32}")


def read_result(path: PathLike) -> Result:
    """Read a JSON result: the value that was exported is returned, number for number.

    Parameters
    ----------
    path : path
        Written by ``export`` or ``weavecore weave --json``.

    Returns
    -------
    SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
        The last stage in the file.

    Raises
    ------
    Unreadable
        Where the file is missing, not JSON, truncated or contradictory.
    Unsupported
        Where it is not a result of weavecore, or of a later version.
    BadIndex, NonFinite, Degenerate, NonManifold
    """
    return decode_result(_read_bytes(path))


def read_weave_or_equilibrium(path: PathLike) -> tuple[Union[Weave, Equilibrium], bytes]:
    """Read a JSON result that has a weave, at rest or not, and give the bytes of the file with it.

    Parameters
    ----------
    path : path

    Returns
    -------
    value : Weave or Equilibrium
    content : bytes
        All of the file.

    Raises
    ------
    Unsupported
        Where the file has no weave; else as `read_result`.
    """
    content = _read_bytes(path)
    result = decode_result(content)
    if not isinstance(result, (Weave, Equilibrium)):
        raise Unsupported(
            f"{path} has no rods", remedy="Use a result that `weavecore weave INPUT --json RESULT.json` wrote."
        )
    return result, content


def decode_result(data: bytes) -> Result:
    """The result in the bytes of a JSON file.

    Parameters
    ----------
    data : bytes

    Returns
    -------
    SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium

    Raises
    ------
    As `read_result`.
    """
    return take_result(_parse(data))


def take_result(values: object) -> Result:
    """The result in the parsed values of a JSON file.

    Parameters
    ----------
    values : object
        As `json.loads` returns them.

    Returns
    -------
    SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium

    Raises
    ------
    As `read_result`.
    """
    document = ResultPart(values)
    if "format" not in document or document.text("format") != FORMAT:
        raise Unsupported(
            "The file is not a result of weavecore",
            remedy="Use a result that `weavecore weave INPUT --json RESULT.json` wrote.",
        )
    if document.number("version") != VERSION:
        raise Unsupported(
            f"The result is of version {document.number('version'):g}, and only version {VERSION} is supported",
            remedy="Weave again with this version of weavecore.",
        )
    surface = _surface(document)
    if "latitudes" not in document:
        return surface
    latitudes = _latitudes(document, surface)
    if "lattice" not in document:
        return latitudes
    lattice = _lattice(document, latitudes)
    if "weave" not in document:
        return lattice
    weave = _take_weave(document, lattice)
    return _take_equilibrium(document.part("equilibrium"), weave) if "equilibrium" in document else weave


def _parse(data: bytes) -> Any:
    try:
        return json.loads(data.decode("utf-8-sig"), parse_constant=_refuse_constant, object_hook=with_arrays)
    except (ValueError, RecursionError) as error:
        detail = "too deep" if isinstance(error, RecursionError) else str(error)
        raise Unreadable(f"The file is not valid JSON: {detail}", remedy="The file is damaged: weave again.") from None


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number")


def _surface(document: ResultPart) -> SurfaceMesh:
    part = document.part("surface")
    vertices = part.floats("vertices", (-1, 3))
    offsets, values = part.rows("cut", len(vertices)) if "cut" in part else (np.zeros(1, np.int64), None)
    cuts = () if values is None else tuple(np.split(values, offsets[1:-1]))
    return SurfaceMesh(
        vertices,
        part.indices("faces", (-1, 3), len(vertices)),
        unit=document.word("unit", _UNIT, "the name of a unit"),
        tolerance=document.number("tolerance", least=0.0),
        cuts=cuts,
        name=part.text("name"),
        notes=_take_notes(document),
        starts=_take_origins(part, len(vertices)) if "origins" in part else None,
    )


def _take_notes(document: ResultPart) -> tuple[Note, ...]:
    """The notes; of a result from before there were any, the repairs that the surface lists."""
    if "notes" not in document:
        surface = document.part("surface")
        return tuple(Note("REPAIRED", text) for text in surface.texts("mendings")) if "mendings" in surface else ()
    notes = []
    for part in document.parts("notes"):
        numbers = part.part("numbers")
        code = part.text("code")
        if code not in NOTE_CODES:
            raise damaged_result(f"{part.path('code')} is {code[:40]!r}, which no note has")
        pairs = {name: numbers.number(name) for name in numbers.names_of_values()}
        notes.append(Note(code, part.text("text"), pairs, part.floats("points", (-1, 3))))
    return tuple(notes)


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
        pattern=document.part("parameters").word("pattern", _PATTERN, "the name of a pattern"),
        edge_length=_positive(document, "edge_length"),
        off_latitudes="off_latitudes" in part and part.flag("off_latitudes"),
    )


def _positive(document: ResultPart, key: str) -> float:
    return document.part("parameters").number(key, least=float(np.finfo(float).tiny))


def _read_bytes(path: PathLike) -> bytes:
    file = Path(path)
    try:
        if not file.is_file():  # A pipe or a device may never end.
            what = "is not a file" if file.exists() else "does not exist"
            raise Unreadable(f"{path} {what}", remedy="Give a result that `weavecore weave --json` wrote.")
        with file.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except WeaveError:
        raise
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise Unreadable(
            f"{path} could not be read: {reason}", remedy="Check the path and file permissions."
        ) from error
    _check_work(path, data)
    return data


def _check_work(path: PathLike, data: bytes) -> None:
    """Refuse bytes that take too much memory to parse."""
    memory = 2 * len(data) + sum(size * data.count(mark) for mark, size in _BYTES_OF.items())
    if len(data) > MOST_BYTES:
        size = Path(path).stat().st_size
        what = f"{path} has {size / 1e6:.0f} MB, more than the limit of {MOST_BYTES / 1e6:.0f} MB"
    elif memory > MOST_MEMORY:
        what = f"{path} would take about {memory / 1e9:.1f} GB of memory, more than {MOST_MEMORY / 1e9:.1f} GB"
    else:
        return
    raise TooMuchWork(what, remedy="Weave with a larger spacing or longer edges, or from a coarser mesh.")


def _take_origins(surface: ResultPart, n_vertices: int) -> Origins:
    """The origins of a surface, of which the vertices were read before; they do not meet."""
    rows = list(surface.parts("origins"))
    paths = tuple(row.indices("vertices", (-1,), n_vertices) for row in rows)
    closed = np.array([row.flag("closed") for row in rows], bool)
    for row, path, is_closed in zip(rows, paths, closed.tolist()):
        if len(path) < (3 if is_closed else 2):
            raise damaged_result(f"{row.path('vertices')} has {len(path)} vertices, too few for a path")
    origins = Origins(paths, closed)
    passed = origins.vertices()
    if len(np.unique(passed)) < len(passed):
        raise damaged_result(f"{surface.path('origins')} pass a vertex twice")
    return origins


def _take_weave(document: ResultPart, lattice: Lattice) -> Weave:
    """The weave on a lattice that was read before."""
    part = document.part("weave")
    rows = list(document.parts("strands"))
    ids = tuple(row.word("id", _ID, "up to 32 letters, digits and underscores") for row in rows)
    places = {name: s for s, name in enumerate(ids)}
    if len(places) != len(ids):
        raise damaged_result("Two strands have the same id")
    strands = _strands(rows, lattice)
    normals = part.floats("normals", (lattice.n_nodes, 3))
    # Results that were written before rods had a diameter each have that of all.
    usual = part.number("rod_diameter", least=_TINY)
    return Weave(
        lattice=lattice,
        strands=strands,
        ids=ids,
        joints=_joints(document, strands, places, lattice.n_nodes),
        axes=_axes(rows, strands, lattice.nodes, normals),
        normals=normals,
        bending=_bending(rows),
        diameters=np.array([row.number("diameter", least=_TINY) if "diameter" in row else usual for row in rows]),
        material=_material(part.part("material")),
        over_under=part.word("over_under", _STYLE, "stacked, plain or a twill such as 'twill 2/2'"),
        conflicts=_conflicts(part, places, lattice.n_nodes),
        clashes=_clashes(part, places),
    )


def _strands(rows: list[ResultPart], lattice: Lattice) -> Strands:
    nodes = [row.indices("nodes", (-1,), lattice.n_nodes) for row in rows]
    closed = np.array([row.flag("closed") for row in rows], bool)
    for row, path, is_closed in zip(rows, nodes, closed.tolist()):
        if len(path) < (3 if is_closed else 2):
            raise damaged_result(f"{row.where}.nodes has {len(path)} nodes, too few for a rod")
    families = {name: k for k, name in enumerate(FAMILIES)}
    return Strands(
        offsets_of([len(path) for path in nodes]),
        np.concatenate([*nodes, np.zeros(0, np.int64)]),
        np.array([row.name("family", families) for row in rows], np.int64),
        closed,
    )


def _joints(document: ResultPart, strands: Strands, places: dict[str, int], n_nodes: int) -> Joints:
    rows = list(document.parts("joints"))
    node = np.array([row.index("node", n_nodes) for row in rows], np.int64)
    if (np.diff(node) <= 0).any():
        raise damaged_result("The nodes of the joints do not rise")
    counts = np.diff(strands.offsets)
    visits: list[Ints] = []
    for row, at in zip(rows, node.tolist()):
        order = np.array([row.name_of(name, "order", places) for name in row.texts("order")], np.int64)
        place = row.indices("places", (len(order),), int(counts.max(initial=0)))
        if len(order) < 2 or (place >= counts[order]).any():
            raise damaged_result(f"{row.where} does not have two rods or more with a place on each")
        visit = strands.offsets[order] + place
        if (strands.nodes[visit] != at).any() or len(np.unique(visit)) < len(visit):
            raise damaged_result(f"{row.where} names rods that do not pass node {at}, or one twice")
        visits.append(visit)
    visit = np.concatenate([*visits, np.zeros(0, np.int64)])
    return Joints(node, offsets_of([len(v) for v in visits]), visit, rows_of(strands.offsets)[visit])


def _axes(rows: list[ResultPart], strands: Strands, nodes: Floats, normals: Floats) -> RodAxes:
    """The axes; what stands in the file once is not there twice: points and derivatives follow from the rest."""
    counts = np.diff(strands.offsets).tolist()
    overhangs = _overhangs(rows, strands)
    knots, controls = _bsplines(rows, counts, strands, overhangs)
    layer_offsets = _joined([row.floats("layer_offsets", (n,)) for row, n in zip(rows, counts)])
    stations = _joined([row.floats("stations", (n,)) for row, n in zip(rows, counts)])
    lengths = np.array([row.number("axis_length", least=_TINY) for row in rows], np.float64)
    owner = rows_of(strands.offsets)
    rises = np.diff(stations)[np.diff(owner) == 0] >= 0
    if not rises.all() or (stations < 0).any() or (stations > lengths[owner] * (1 + 1e-9)).any():
        raise damaged_result("The stations of a strand do not rise from 0 to its length")
    points = nodes[strands.nodes] + layer_offsets[:, None] * normals[strands.nodes]
    room = _FROM_NODE * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    fitted = fit_splines(points, strands.offsets, strands.closed)
    parameters, ends = tip_parameters(fitted, strands.offsets, overhangs)
    splines = BSplineRows(
        offsets_of([len(one) for one in knots]),
        _joined(knots),
        offsets_of([len(one) for one in controls]),
        np.concatenate([*controls, np.zeros((0, 3))]),
    )
    off = np.abs(b_spline_points(splines, owner, parameters) - points).max(axis=1, initial=0.0)
    if not (off <= room).all():
        row = rows[int(owner[np.flatnonzero(~(off <= room))[0]])]
        raise damaged_result(f"{row.where}.axis does not pass through the places of its strand")
    return RodAxes(
        offsets=strands.offsets,
        closed=strands.closed,
        points=points,
        derivatives=fitted.derivatives,
        parameters=parameters,
        ends=ends,
        overhangs=overhangs,
        knot_offsets=splines.knot_offsets,
        knots=splines.knots,
        control_offsets=splines.control_offsets,
        controls=splines.controls,
        stations=stations,
        lengths=lengths,
        layer_offsets=layer_offsets,
    )


def _overhangs(rows: list[ResultPart], strands: Strands) -> Floats:
    """(S, 2) how far each rod runs on beyond its first and its last visit."""
    overhangs = np.array([row.floats("overhangs", (2,)) for row in rows], np.float64).reshape(-1, 2)
    if (overhangs < 0).any() or overhangs[strands.closed].any():
        raise damaged_result("The overhangs of a strand are negative, or it is closed and has overhangs")
    return overhangs


def _bsplines(
    rows: list[ResultPart], counts: list[int], strands: Strands, overhangs: Floats
) -> tuple[list[Floats], list[Floats]]:
    """Knots and control points of every strand, of which there are as many as its visits ask for."""
    knots, controls = [], []
    n_tips = (overhangs > 0).sum(axis=1).tolist()
    for row, n, is_closed, tips in zip(rows, counts, strands.closed.tolist(), n_tips):
        axis = row.part("axis")
        spans = n if is_closed else n - 1 + tips
        if axis.number("degree") != DEGREE:
            raise damaged_result(f"{axis.where} is not of degree {DEGREE}")
        found = axis.floats("knots", (spans + 1 + 2 * DEGREE,))
        if (np.diff(found) < 0).any() or not (np.diff(found[DEGREE:-DEGREE]) > 0).all():
            raise damaged_result(f"{axis.where}.knots do not rise")
        knots.append(found)
        controls.append(axis.floats("controls", (spans + DEGREE, 3)))
    return knots, controls


def _bending(rows: list[ResultPart]) -> Bending:
    def or_infinite(row: ResultPart, key: str) -> float:
        value = row.number_or_none(key)
        return np.inf if value is None else value

    return Bending(
        min_radius=np.array([or_infinite(row, "min_radius") for row in rows]),
        station_at_min=np.array([row.number("station_at_min") for row in rows]),
        point_at_min=np.array([row.floats("point_at_min", (3,)) for row in rows]),
        utilisation=np.array([row.number("utilisation", least=0.0) for row in rows]),
        largest_diameter=np.array([or_infinite(row, "largest_diameter") for row in rows]),
    )


def _material(part: ResultPart) -> Material:
    return Material(
        part.text("name"),
        modulus=part.number("modulus"),
        strength=part.number("strength"),
        factor=part.number("factor"),
        density=part.number("density", least=0.0),
        source=part.text("source"),
    )


def _conflicts(part: ResultPart, places: dict[str, int], n_nodes: int) -> Ints:
    rows = [
        [row.name("strand", places), row.index("node", n_nodes), row.index("node_before", n_nodes)]
        for row in part.parts("conflicts")
    ]
    return np.array(rows, np.int64).reshape(-1, 3)


def _clashes(part: ResultPart, places: dict[str, int]) -> Clashes:
    rows = list(part.parts("clashes"))
    pairs = [[row.name_of(name, "strands", places) for name in row.texts("strands")] for row in rows]
    if any(len(pair) != 2 for pair in pairs):
        raise damaged_result("A clash is not of two strands")
    return Clashes(
        np.array(pairs, np.int64).reshape(-1, 2),
        np.array([row.number("distance", least=0.0) for row in rows]),
        np.array([row.floats("point", (3,)) for row in rows]).reshape(-1, 3),
    )


def _take_equilibrium(part: ResultPart, weave: Weave) -> Equilibrium:
    """The equilibrium of a weave that was read before, of the object under the key ``equilibrium``."""
    rows = list(part.parts("axes"))
    ids = [row.text("id") for row in rows]
    if ids != list(weave.ids):
        raise damaged_result("equilibrium.axes does not have one entry for each strand, in their order")
    points = [row.floats("points", (-1, 3)) for row in rows]
    counts = [len(one) for one in points]
    offsets = offsets_of(counts)
    joints = np.diff(weave.strands.offsets).tolist()
    places = [row.indices("joints", (m,), n) for row, m, n in zip(rows, joints, counts)]

    def joined(key: str) -> Floats:
        return np.concatenate([*(row.floats(key, (n,)) for row, n in zip(rows, counts)), np.zeros(0)])

    reaction = np.zeros((weave.lattice.n_nodes, 3))
    held = np.zeros(weave.lattice.n_nodes, bool)
    for row in part.parts("reactions"):
        node = row.index("node", weave.lattice.n_nodes)
        reaction[node], held[node] = row.floats("force", (3,)), True
    energies = part.part("energies")
    buckles = part.flag_or_none("buckles")
    factor = part.number_or_none("buckling_factor")
    return Equilibrium(
        weave=weave,
        points=np.concatenate([*points, np.zeros((0, 3))]),
        drawn=np.concatenate([*(row.floats("drawn", (n, 3)) for row, n in zip(rows, counts)), np.zeros((0, 3))]),
        offsets=offsets,
        point_of_visit=np.concatenate([*(start + at for start, at in zip(offsets, places)), np.zeros(0, np.int64)]),
        axial_force=joined("axial_force"),
        moment=joined("moment"),
        stress=joined("stress"),
        tie_force=part.floats("tie_forces", (len(weave.joints.contacts), 3)),
        reaction=reaction,
        is_supported=held,
        is_converged=part.flag("converged"),
        n_negative=int(part.number("negative_modes", least=0.0)),
        n_steps=int(part.number("steps", least=0.0)),
        residual=part.number("residual", least=0.0),
        energies={key: energies.number(key) for key in ("bending", "axial", "ties")},
        drawn_energy=part.number("drawn_energy"),
        supports=part.text("supports"),
        loads=part.text("loads"),
        buckling_factor=float("inf") if buckles is False else factor,
        # Results from before loads were written have none.
        load=part.floats("node_loads", reaction.shape) if "node_loads" in part else np.zeros_like(reaction),
        spread=tuple(part.indices("spread", (-1,), weave.lattice.n_nodes).tolist()) if "spread" in part else (),
    )


def _joined(arrays: list[Floats]) -> Floats:
    return np.concatenate([*arrays, np.zeros(0)])
