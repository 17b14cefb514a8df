"""Report what a file holds, and for each object whether it can be woven."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Optional

import numpy as np

from weavecore.errors import WeaveError
from weavecore.files import PathLike
from weavecore.geometry.arrays import Floats
from weavecore.model import InspectionMark, Note, SurfaceMesh
from weavecore.model.notes import texts_of
from weavecore.polling import pollable
from weavecore.reading.choose import is_candidate
from weavecore.reading.curves import curve_from
from weavecore.reading.formats.mesh_file import read_mesh_file
from weavecore.reading.formats.rhino_3dm import CURVE, IN_BLOCK, RhinoDocument, RhinoObject, open_document
from weavecore.reading.pieces import SurfacePiece, pieces_of, spanned_area
from weavecore.reading.raw import RawMesh
from weavecore.reading.read import check_ending, is_rhino, raw_from_document
from weavecore.reading.repair import repair
from weavecore.reading.sandbox import Progress, call_guarded, limits_for_all

_MOST_GAPS = 200
"""Borders between which gaps are measured: each is compared with all others."""

_NARROW = 0.01
"""Of the size: a gap between borders that is marked."""

_MOST_MARKS = 2000
"""Marks of an object: more are too many to look at."""


@dataclass(frozen=True)
class BorderReport:
    """One border of an object.

    Parameters
    ----------
    length : float
    area : float
        That it spans: of a plane border what it encloses.
    gap : float or None
        Shortest distance of its vertices to another border's; None where there is none.
    at : (x, y, z)
        Where that is.
    """

    length: float
    area: float
    gap: Optional[float]
    at: tuple[float, ...]


@dataclass(frozen=True)
class ObjectReport:
    """One object of a file, and what weaving it would find.

    Parameters
    ----------
    id, name, kind, layer : str
        As in Rhino; the kind of a mesh file is "Mesh".
    n_faces : int
        Triangles of its surface; 0 where there is none.
    border_lengths : tuple of float
        Length of each border loop, in the file's unit.
    euler_characteristic : int or None
    is_candidate : bool
        Whether it is selected without being named.
    aside : str
        Why it is not: "hidden", "locked", "on a layer that is off", "part of a block"; or "".
    code : str
        "" if it can be woven, else the code of the error.
    message : str
        The error, or what would be repaired.
    notes : tuple of Note
    pieces : tuple of SurfacePiece
        Connected components.
    borders : tuple of BorderReport
        One for each of ``border_lengths``.
    marks : tuple of InspectionMark
        Bad edges, gaps, notes and borders, to be looked at.
    """

    id: str
    name: str
    kind: str
    layer: str
    n_faces: int
    border_lengths: tuple[float, ...]
    euler_characteristic: Optional[int]
    is_candidate: bool
    aside: str
    code: str
    message: str
    notes: tuple[Note, ...] = ()
    pieces: tuple[SurfacePiece, ...] = ()
    borders: tuple[BorderReport, ...] = ()
    marks: tuple[InspectionMark, ...] = ()

    @property
    def n_borders(self) -> int:
        """Number of border loops."""
        return len(self.border_lengths)


@dataclass(frozen=True)
class CurveReport:
    """A curve of a file, at which distances may start.

    Parameters
    ----------
    id, name, layer : str
        As in Rhino.
    length : float
        In the file's unit.
    is_closed : bool
    """

    id: str
    name: str
    layer: str
    length: float
    is_closed: bool


@dataclass(frozen=True)
class FileReport:
    """The contents of a file.

    Parameters
    ----------
    path : str
    format : str
        The file's ending without its dot.
    version : int or None
        Of Rhino; None for a mesh file.
    unit : str
        Rhino's name, or "None".
    tolerance : float
    layers : tuple of str
        Full paths.
    objects : tuple of ObjectReport
        Those of the kinds that a surface can be made of.
    others : tuple of (kind, count)
        Number of objects of each other kind.
    curves : tuple of CurveReport
        Those of the others that are curves.
    part_names : tuple of str
        Objects and groups of an .obj, where there are several.
    """

    path: str
    format: str
    version: Optional[int]
    unit: str
    tolerance: float
    layers: tuple[str, ...]
    objects: tuple[ObjectReport, ...]
    others: tuple[tuple[str, int], ...]
    curves: tuple[CurveReport, ...] = ()
    part_names: tuple[str, ...] = ()


@pollable
def inspect_file(
    path: PathLike,
    *,
    guarded: bool = False,
    time_limit: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> FileReport:
    """Report every object of a file that a surface can be made of.

    Parameters
    ----------
    path : path
    guarded : bool
        Read in a sandboxed worker, so that a damaged file can neither end this process nor block it.
    time_limit : float, optional
        Seconds that the worker may take for each object; by default from the size of the file: see `limits_for_all`.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    FileReport

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork
        Where the file as a whole cannot be read; what is wrong with one object is in its report.
    """
    if guarded:
        limits = limits_for_all(path, time_limit=time_limit)
        classes = (FileReport, ObjectReport, CurveReport, BorderReport, SurfacePiece, Note, InspectionMark)
        report: FileReport = call_guarded(_inspect, path, limits=limits, progress=progress, classes=classes)
        return report
    return _inspect(path, progress=progress)


def _inspect(path: PathLike, *, progress: Optional[Progress]) -> FileReport:
    if is_rhino(path):
        return _inspect_document(path, open_document(path), progress or _no_progress)
    check_ending(path)
    format_ = Path(path).suffix.lower()[1:]
    try:
        raw = read_mesh_file(path)
    except (LookupError, ValueError) as error:
        if not isinstance(error, WeaveError):
            raise
        only = _refused(RhinoObject("", Path(path).stem, "Mesh", "", "", None), error)
    else:
        only = _report(RhinoObject("", raw.name, "Mesh", "", "", None), raw)
        names = tuple(dict.fromkeys(name for part in raw.part_names for name in part))
        return FileReport(str(path), format_, None, "None", 0.0, (), (only,), (), (), names)
    return FileReport(str(path), format_, None, "None", 0.0, (), (only,), ())


def _no_progress(_fraction: float, _label: str) -> None:
    """Stands for a missing callback."""


def _inspect_document(path: PathLike, document: RhinoDocument, progress: Progress) -> FileReport:
    reports, others = [], dict[str, int]()
    for number, one in enumerate(document.objects):
        progress(number / len(document.objects), "Reading objects")
        if not one.is_surface:
            others[one.kind] = others.get(one.kind, 0) + 1
            continue
        try:
            reports.append(_report(one, raw_from_document(document, one)))
        except WeaveError as error:
            reports.append(_refused(one, error))
    return FileReport(
        path=str(path),
        format="3dm",
        version=document.version,
        unit=document.unit,
        tolerance=document.tolerance,
        layers=document.layers,
        objects=tuple(reports),
        others=tuple(sorted(others.items())),
        curves=tuple(_report_curves(document)),
    )


def _report_curves(document: RhinoDocument) -> Iterator[CurveReport]:
    for one in document.objects:
        if one.kind == CURVE and one.aside != IN_BLOCK:
            with contextlib.suppress(WeaveError):  # Damaged curves are only counted among the others.
                points = curve_from(one.geometry, tolerance=document.tolerance)
                step = np.linalg.norm(np.diff(points, axis=0), axis=1)
                is_closed = bool(one.geometry.IsClosed)
                yield CurveReport(one.id, one.name, one.layer, float(step.sum()), is_closed)


def _report(one: RhinoObject, raw: RawMesh) -> ObjectReport:
    try:
        surface = repair(raw, is_cut=False)
    except WeaveError as error:
        return _refused(one, error)
    borders = tuple(_report_borders(surface))
    return ObjectReport(
        id=one.id,
        name=one.name,
        kind=one.kind,
        layer=one.layer,
        n_faces=surface.n_faces,
        border_lengths=_border_lengths(surface),
        euler_characteristic=surface.euler_characteristic,
        is_candidate=is_candidate(one),
        aside=one.aside,
        code="",
        message=" ".join(texts_of(surface.notes)),
        notes=surface.notes,
        pieces=pieces_of(surface),
        borders=borders,
        marks=tuple(_marks(surface, borders))[:_MOST_MARKS],
    )


def _refused(one: RhinoObject, error: WeaveError) -> ObjectReport:
    ends = np.reshape(error.points, (-1, 2, 3)) if error.points else np.zeros((0, 2, 3))
    marks = tuple(InspectionMark("edges", error.code, pair) for pair in ends[:_MOST_MARKS])
    return ObjectReport(
        id=one.id,
        name=one.name,
        kind=one.kind,
        layer=one.layer,
        n_faces=0,
        border_lengths=(),
        euler_characteristic=None,
        is_candidate=is_candidate(one),
        aside=one.aside,
        code=error.code,
        message=str(error),
        marks=marks,
    )


def _report_borders(surface: SurfaceMesh) -> Iterator[BorderReport]:
    """Length, area and gap of each border."""
    from scipy.spatial import cKDTree

    loops = surface.borders
    owner = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    points = surface.vertices[np.concatenate([np.zeros(0, np.int64), *loops])]
    for k, loop in enumerate(loops):
        gap, where = None, surface.vertices[loop[0]]
        others = points[owner != k] if len(loops) <= _MOST_GAPS else points[:0]
        if len(others):
            distance = np.asarray(cKDTree(others).query(surface.vertices[loop])[0])
            gap, where = float(distance.min()), surface.vertices[loop[int(distance.argmin())]]
        spanned = spanned_area(surface.vertices[loop])
        yield BorderReport(_length(surface.vertices[loop]), spanned, gap, tuple(where.tolist()))


def _marks(surface: SurfaceMesh, borders: tuple[BorderReport, ...]) -> Iterator[InspectionMark]:
    """Dots at notes and at narrow gaps, and borders as curves."""
    for note in surface.notes:
        for point in np.reshape(note.points, (-1, 3)):
            yield InspectionMark("notes", note.code, point[None])
    for number, (border, loop) in enumerate(zip(borders, surface.borders)):
        if border.gap is not None and border.gap < _NARROW * surface.size:
            yield InspectionMark("gaps", f"gap of {border.gap:.3g}", np.array([border.at]))
        yield InspectionMark("borders", f"border {number}", surface.vertices[np.append(loop, loop[0])])


def _border_lengths(surface: SurfaceMesh) -> tuple[float, ...]:
    return tuple(_length(surface.vertices[loop]) for loop in surface.borders)


def _length(loop: Floats) -> float:
    return float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum())
