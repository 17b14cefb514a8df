"""The public verbs, and the only place where the stages are chained.

A stage that most commands do without is imported where it is called: loading all takes longer than a small weave.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Optional, Union

import numpy as np

from weavecore.errors import Doubtful, Unsupported
from weavecore.exporting.product import Product, StageValue
from weavecore.exporting.registry import encode, register_writer, writer_for
from weavecore.fabricating.tie_strength import DEFAULT_TIE
from weavecore.fabricating.workshop import Workshop
from weavecore.files import PathLike, check_folder, check_targets, write_folder, write_together, write_whole
from weavecore.model import (
    Equilibrium,
    Latitudes,
    Lattice,
    Material,
    Replay,
    Strands,
    SurfaceMesh,
    Weave,
)
from weavecore.polling import pollable
from weavecore.units import check_length, millimetres_in

if TYPE_CHECKING:
    from weavecore.fabricating.workshop_folder import Fabrication, describe_fabrication
    from weavecore.linking.link import spacing_for_edges
    from weavecore.offsetting.graded_spacing import FactorAtPoint
    from weavecore.offsetting.sources import start_at
    from weavecore.offsetting.spacing import Spacing, suggest_spacing
    from weavecore.reading import (
        FileReport,
        curves_from,
        inspect_file,
        read_curves,
        read_places,
        read_result,
        read_surface,
        surface_from,
    )
    from weavecore.structural_analysis import (
        check_equilibrium_folder,
        compensate,
        replay,
        simulate,
        write_equilibrium_tables,
        write_handover,
        write_replay,
    )
    from weavecore.validating import validate
    from weavecore.weaving.layout import Layout

__all__ = [
    "Workshop",
    "check_equilibrium_folder",
    "compensate",
    "curves_from",
    "describe_fabrication",
    "draw_picture",
    "export",
    "fabricate",
    "inspect_file",
    "lay_out",
    "link",
    "offset",
    "read_curves",
    "read_places",
    "read_result",
    "read_surface",
    "refuse_doubts",
    "replay",
    "simulate",
    "spacing_for_edges",
    "start_at",
    "suggest_spacing",
    "surface_from",
    "validate",
    "weave",
    "write_equilibrium_tables",
    "write_handover",
    "write_marks",
    "write_replay",
]

_ELSEWHERE = {
    "weavecore.fabricating.workshop_folder": ("describe_fabrication",),
    "weavecore.linking.link": ("spacing_for_edges",),
    "weavecore.offsetting.sources": ("start_at",),
    "weavecore.offsetting.spacing": ("suggest_spacing",),
    "weavecore.reading": (
        "curves_from",
        "inspect_file",
        "read_curves",
        "read_places",
        "read_result",
        "read_surface",
        "surface_from",
    ),
    "weavecore.structural_analysis": (
        "check_equilibrium_folder",
        "compensate",
        "replay",
        "simulate",
        "write_equilibrium_tables",
        "write_handover",
        "write_replay",
    ),
    "weavecore.validating": ("validate",),
}
"""Verbs that are imported when they are asked for, by the module that has them."""

Progress = Callable[[float, str], None]
"""Called with what is done, from 0 to 1, and a label; raising in it cancels the work."""

PICTURE, PAGE = ".png", ".html"
WOVEN = "woven.3dm"


def __getattr__(name: str) -> Any:
    """Import a verb from elsewhere when it is asked for."""
    home = next((module for module, names in _ELSEWHERE.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(home), name)
    return value


def _offset_levels(surface: SurfaceMesh, **options: Any) -> Latitudes:
    from weavecore.offsetting.level_sets import offset_levels

    return offset_levels(surface, **options)


def _offset_fronts(surface: SurfaceMesh, **options: Any) -> Latitudes:
    from weavecore.offsetting.propagation.method import offset_fronts

    return offset_fronts(surface, **options)


METHODS: dict[str, Callable[..., Latitudes]] = {"levels": _offset_levels, "fronts": _offset_fronts}


@pollable
def offset(
    surface: SurfaceMesh,
    *,
    spacing: Optional[Spacing] = None,
    method: str = "levels",
    borders: Optional[Iterable[int]] = None,
    curves: Optional[Iterable[Any]] = None,
    factors: Optional[Iterable[FactorAtPoint]] = None,
    reach: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Latitudes:
    """Offset the borders of a surface inwards until they fill it (Yan et al. 2016, §4).

    Parameters
    ----------
    surface : SurfaceMesh
    spacing : float or sequence of float, optional
        Distance from one polyline to the next along the surface, in the model's unit; by default what
        `suggest_spacing` gives.  Of several the first is that from the borders, and the last goes on.
    method : str
        ``"levels"``: level sets of the distance from the borders; ``"fronts"``: polylines moved step by
        step, as in the paper.
    borders : iterable of int, optional
        Places in ``surface.borders`` of those that distances start at; by default all.  The others cut the
        polylines, which then are open.
    curves : iterable of (n, 3) array_like or curves of Rhino, optional
        What distances start at, on both sides, and at no border then that is not chosen; closed where it comes back.
    factors : iterable of ((3,) array_like, float), optional
        Points with a factor of the spacing near them: below 1 rings are denser, above 1 wider apart.  Rings stay
        parallel: each takes the mean of the factors along it.
    reach : float, optional
        Distance at which a single point has half of its effect; by default a quarter of the surface's extent.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Latitudes
        On the surface as it was woven, with notes: borders shorter than a hundredth of the spacing are closed, unless
        distances start at chosen ones; polylines of parts that pass through each other cross.

    Raises
    ------
    SpacingTooLarge, TooMuchWork, Unsupported, BadIndex, BadCurve
    """
    from weavecore.offsetting.graded_spacing import grade_spacing, spacing_field
    from weavecore.offsetting.passing_sheets import note_crossings
    from weavecore.offsetting.sources import start_at
    from weavecore.offsetting.spacing import suggest_spacing
    from weavecore.reading import curves_from
    from weavecore.reading.pieces import fill_specks
    from weavecore.reading.thickness import note_thickness

    if method not in METHODS:
        raise Unsupported(f"Unknown method {method!r}", remedy=f"Take one of: {', '.join(METHODS)}.")
    points = None if curves is None else curves_from(curves, tolerance=surface.tolerance)
    started = start_at(surface, borders=borders, curves=points)
    wanted = suggest_spacing(started) if spacing is None else spacing
    for length in (float(np.min(wanted)), float(np.max(wanted))):
        check_length(length, "A spacing")
    field = spacing_field(started, factors or (), reach)
    if field is not None:
        started, wanted = grade_spacing(started, wanted, field)
    least = float(np.min(wanted))
    if np.isfinite(least) and least > 0:  # Else the method refuses it.
        started = note_thickness(fill_specks(started, least), least)
    return note_crossings(METHODS[method](started, spacing=wanted, progress=progress))


def refuse_doubts(surface: SurfaceMesh) -> None:
    """Raise where something about a surface is doubted.

    Parameters
    ----------
    surface : SurfaceMesh
        With its notes; that of a result has those of the later stages too.

    Raises
    ------
    Doubtful
    """
    doubts = [note for note in surface.notes if note.is_doubt]
    if doubts:
        raise Doubtful(
            " ".join(f"{note.code}: {note.text}" for note in doubts),
            remedy="Repair the input, or weave it without strict.",
        )


@pollable
def link(
    latitudes: Latitudes,
    *,
    edge_length: Optional[float] = None,
    pattern: str = "triangular",
    free_rings: bool = False,
    progress: Optional[Progress] = None,
) -> Lattice:
    """Divide the latitudes, bind them to a lattice (Yan et al. 2016, §5), and smooth it so that rods bend little.

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float, optional
        Length that the edges along the latitudes come near to, in the model's unit: those of the triangular lattice
        from which a hexagonal, kagome or diagonal one is made.  By default the one that makes equilateral triangles,
        or squares, at the spacing of the latitudes.
    pattern : str
        ``"triangular"``, ``"quad"``, ``"plain"``, ``"twill"``, ``"hexagonal"``, ``"kagome"`` or ``"diagonal"``.
    free_rings : bool
        Whether nodes may leave the latitudes where that lets rods bend less.  By default rings keep their exact
        distance from the borders; the patterns hexagonal, kagome and diagonal have no rings to keep.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Lattice
        Its surface has a note COARSE where faces are inverted, or edges far off the surface or without length.

    Raises
    ------
    TooMuchWork, Unsupported
    """
    from weavecore.linking.link import link_pattern
    from weavecore.model.lattice_fit import note_far_edges, note_inverted_faces, note_short_edges

    check_length(edge_length, "An edge length")
    lattice = link_pattern(
        latitudes, edge_length=edge_length, pattern=pattern, free_rings=free_rings, progress=progress
    )
    return note_short_edges(note_far_edges(note_inverted_faces(lattice)))


@pollable
def weave(
    lattice: Lattice,
    *,
    rod_diameter: Union[float, Mapping[str, float], None] = None,
    stock: Optional[Sequence[float]] = None,
    material: Union[str, Material] = "gfrp",
    over_under: Optional[str] = None,
    layout: Optional[Layout] = None,
    progress: Optional[Progress] = None,
) -> Weave:
    """Lay rods over and under each other along the edges of a lattice (Yan et al. 2016, §3 and §6).

    Parameters
    ----------
    lattice : Lattice
    rod_diameter : float or mapping, optional
        In the model's unit; one for all rods, or one for each family: ``{"latitudinal": 3.0, "longitudinal": 2.0}``,
        where those of a ``"pocket"`` are as the longitudinal ones if they are not named.  By default the thickest
        stock diameter in which nearly all rods can be bent to their places.
    stock : sequence of float, optional
        Diameters to choose from, in the model's unit; by default those in which the material is sold.
    material : str or Material
        A name in the table of materials, or one of your own.
    over_under : str, optional
        ``"stacked"``: in layers that rods do not leave; ``"plain"``: over, under, over…;
        ``"twill 2/2"`` or others: over two, under two.  By default what the lattice's pattern is woven in.
    layout : Layout, optional
        From `lay_out` with the same lattice and style, so that only what depends on the diameter is computed: the
        weave is the same without.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Weave

    Raises
    ------
    Unsupported
    """
    from weavecore.weaving.weave import weave_lattice

    asked = list(rod_diameter.values()) if isinstance(rod_diameter, Mapping) else [rod_diameter]
    for diameter in (*asked, *(stock or ())):
        check_length(diameter, "A rod diameter")
    return weave_lattice(
        lattice,
        rod_diameter=rod_diameter,
        stock=stock,
        material=material,
        over_under=over_under,
        layout=layout,
        progress=progress,
    )


@pollable
def lay_out(lattice: Lattice, *, over_under: Optional[str] = None, progress: Optional[Progress] = None) -> Layout:
    """Find the rods of a lattice and which lies over which, whatever their diameter: for several calls of `weave`.

    Parameters
    ----------
    lattice : Lattice
    over_under : str, optional
        As of `weave`.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Layout

    Raises
    ------
    Unsupported
    """
    from weavecore.weaving.layout import lay_out_rods

    if progress is not None:
        progress(0.0, "finding the strands")
    return lay_out_rods(lattice, over_under)


def read_rods(path: PathLike) -> Weave:
    """The weave of a JSON result; see `read_result`.

    Raises
    ------
    Unsupported
        Where the file has no weave.
    """
    from weavecore.reading.formats.result_json import read_weave_or_equilibrium

    value, _ = read_weave_or_equilibrium(path)
    return value.weave if isinstance(value, Equilibrium) else value


def export(
    value: StageValue,
    path: PathLike,
    *,
    overwrite: bool = False,
    parameters: Optional[Mapping[str, object]] = None,
) -> None:
    """Write a stage's result by the ending of ``path``, whole or not at all.

    ``.3dm`` and ``.json`` hold every result, with the strands of a lattice; ``.obj``, ``.ply``, ``.off``
    and ``.stl`` hold the faces of a surface or a lattice, and the rods of a weave as pipes, but no equilibrium;
    ``.png`` is a picture and ``.html`` a page to look at the result in three dimensions, which opens offline.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    path : path
    overwrite : bool
        Whether a file that is there already is replaced.
    parameters : mapping, optional
        Options to be named in the file, besides those that the value knows.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    export_together(value, [path], overwrite=overwrite, parameters=parameters)


@pollable
def export_together(
    value: StageValue,
    paths: Iterable[PathLike],
    *,
    overwrite: bool = False,
    parameters: Optional[Mapping[str, object]] = None,
    progress: Optional[Progress] = None,
) -> None:
    """Write a stage's result to several files, of which none appears before all are complete; see `export`."""
    targets = list(paths)
    check_outputs(targets, overwrite=overwrite)
    strands = _strands_of(value) if isinstance(value, Lattice) else None
    contents: dict[PathLike, bytes] = {}
    for done, path in enumerate(targets):
        if progress:
            progress(done / len(targets), f"writing {Path(path).name}")
        contents[path] = encode(value, path, strands=strands, parameters=parameters)
    write_together(contents, overwrite=overwrite)


def _strands_of(lattice: Lattice) -> Strands:
    from weavecore.weaving.strands import find_strands

    return find_strands(lattice)


def check_outputs(paths: Iterable[PathLike], *, overwrite: bool = False, inputs: Iterable[PathLike] = ()) -> None:
    """Raise what `export_together` would raise of the paths alone, before any work is done; also for an input's path.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    targets = list(paths)
    for path in targets:
        writer_for(path)
    check_targets(targets, overwrite=overwrite, inputs=inputs)


def write_marks(
    report: FileReport, path: PathLike, *, overwrite: bool = False, inputs: Iterable[PathLike] = ()
) -> None:
    """Write what `inspect_file` found to look at: bad edges, gaps and borders as coloured curves, notes as dots.

    Parameters
    ----------
    report : FileReport
    path : path
        Ends with ``.3dm``.
    overwrite : bool
        Whether a file that is there already is replaced.
    inputs : iterable of path
        Files that must not be replaced.

    Raises
    ------
    OutputExists, NotWritten
    """
    from weavecore.exporting.marks_file import encode_marks

    marks = [mark for one in report.objects for mark in one.marks]
    check_targets([path], overwrite=overwrite, inputs=inputs)
    write_whole(path, encode_marks(marks, unit=report.unit, tolerance=report.tolerance), overwrite=overwrite)


def draw_picture(
    value: StageValue,
    path: PathLike,
    *,
    size: tuple[int, int] = (1600, 1200),
    view: Any = None,
    overwrite: bool = False,
) -> None:
    """Draw a picture of a stage's result to a .png, whole or not at all.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    path : path
        Ends with ``.png``.
    size : (int, int)
        Width and height in pixels.
    view : (3,) array_like, optional
        Direction from the middle of the surface to the eye, z up; chosen so that much is seen
        where it is not given.
    overwrite : bool
        Whether a file that is there already is replaced.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    if Path(path).suffix.lower() != PICTURE:
        raise Unsupported(f"{path} has no ending of a picture", remedy=f"End the name with {PICTURE}.")
    from weavecore.viewing.picture import encode_picture

    check_targets([path], overwrite=overwrite)
    write_whole(path, encode_picture(value, size=size, view=view), overwrite=overwrite)


@pollable
def fabricate(
    result: Union[Weave, Equilibrium, PathLike],
    folder: PathLike,
    *,
    workshop: Optional[Workshop] = None,
    simulation: Union[Equilibrium, PathLike, None] = None,
    tie_strength: float = DEFAULT_TIE.strength,
    overhang: Optional[float] = None,
    unit: Optional[str] = None,
    overwrite: bool = False,
    progress: Optional[Progress] = None,
) -> Fabrication:
    """Write the folder that a workshop builds a weave from, whole or not at all (Yan et al. 2016, §6).

    Tables of rods, pieces, marks and joints, templates, a sequence, a bill of materials and a report, in millimetres;
    of a weave that was simulated also where it comes to rest, and the forces.  The .3dm is left out where rhino3dm is
    not installed.  See docs/fabrication.md.

    Parameters
    ----------
    result : Weave, Equilibrium or path
        A weave, at rest or not, or a JSON result that has one.
    folder : path
    workshop : Workshop, optional
        Length of the stock, kind of splices and such.
    simulation : Equilibrium or path, optional
        The same weave at rest, where ``result`` is not.
    tie_strength : float
        What a cable tie carries, in N.
    overhang : float, optional
        How far rods run past their outermost ties, in millimetres; without it as far as the weave has them run.
    unit : str, optional
        Unit of the result where it says none: ``"mm"``, ``"m"``, ``"in"``…
    overwrite : bool
        Whether a folder of the same kind that is there already is replaced.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Fabrication
        The files, and the results of their checks.

    Raises
    ------
    Unsupported, TooMuchWork, OutputExists, NotWritten, and what `read_result` raises
    """
    from weavecore.fabricating.csv_tables import Source
    from weavecore.fabricating.equilibrium_tables import EQUILIBRIUM_FILES, build_equilibrium_tables
    from weavecore.fabricating.work import check_work
    from weavecore.fabricating.workshop_folder import NAMES, Fabrication, check_libraries, fabricate_weave
    from weavecore.reading.formats.result_json import read_weave_or_equilibrium
    from weavecore.weaving.sequence import find_sequence

    tell = progress or (lambda _fraction, _label: None)
    shop = workshop or Workshop()
    names = [*NAMES, *EQUILIBRIUM_FILES, WOVEN]
    check_folder(folder, names, overwrite=overwrite)
    check_libraries(shop)
    tell(0.0, "reading")
    value: Union[Weave, Equilibrium]
    if isinstance(result, (Weave, Equilibrium)):
        value, content = result, encode(result, "result.json")
    else:
        value, content = read_weave_or_equilibrium(result)
    weave = value.weave if isinstance(value, Equilibrium) else value
    at_rest = None
    if simulation is not None or value is not weave:
        from weavecore.structural_analysis import simulation_of

        at_rest = simulation_of(weave, value if simulation is None else simulation)
    scale = millimetres_in(weave.lattice.latitudes.surface.unit, unit)
    check_work(weave, scale=scale, stock=shop.stock)
    source = Source.of(weave, content)
    if overhang is not None:
        from weavecore.weaving.overhangs import with_overhangs

        weave = with_overhangs(weave, overhang / scale)
    made = fabricate_weave(
        weave,
        find_sequence(weave, spread=at_rest.spread if at_rest else ()),
        scale=scale,
        workshop=shop,
        source=source,
        equilibrium_tables=build_equilibrium_tables(at_rest, scale=scale, tie_strength=tie_strength) if at_rest else (),
        progress=lambda done, label: tell(0.8 * done, label),
    )
    tell(0.8, f"writing {WOVEN}")
    stated = {"weavecore": source.version, "input_sha256": source.sha256}
    files = dict(made.files)
    if find_spec("rhino3dm") is not None:
        files[WOVEN] = encode(at_rest or weave, WOVEN, parameters=stated)
    write_folder(folder, files, names=names, overwrite=overwrite)
    return Fabrication(files, made.checks)


def describe(value: Union[StageValue, Replay]) -> list[tuple[str, str]]:
    """A stage's result and those before it in a few lines: pairs of a label and a text."""
    from weavecore.viewing import summary

    if isinstance(value, SurfaceMesh):
        return summary.describe_surface(value)
    if isinstance(value, Latitudes):
        return describe(value.surface) + summary.describe_latitudes(value)
    if isinstance(value, Lattice):
        return describe(value.latitudes) + summary.describe_lattice(value, _strands_of(value))
    if isinstance(value, Replay):
        return summary.describe_replay(value)
    if isinstance(value, Equilibrium):
        return describe(value.weave) + summary.describe_equilibrium(value)
    of_lattice = summary.describe_lattice(value.lattice, value.strands)
    return describe(value.lattice.latitudes) + of_lattice + summary.describe_weave(value)


def _picture_of(product: Product) -> bytes:
    from weavecore.viewing.picture import encode_picture

    return encode_picture(product.value)


def _page_of(product: Product) -> bytes:
    from weavecore.viewing.page.html_page import encode_page
    from weavecore.weaving.sequence import find_sequence

    spread = product.equilibrium.spread if product.equilibrium else ()
    sequence = None if product.weave is None else find_sequence(product.weave, spread=spread)
    strands = product.strands
    if strands is None and product.lattice is not None:
        strands = _strands_of(product.lattice)
    return encode_page(product.value, strands=strands, sequence=sequence)


register_writer(PICTURE, _picture_of)
register_writer(PAGE, _page_of)
