"""Parsers of typed arguments: lengths, planes, names; and the options that several commands share."""
# ruff: noqa: FA100 - typer reads the annotations, on Python 3.9 only where they are not strings.

import math
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Callable, Optional, Union

import typer

from weavecore.errors import Unsupported
from weavecore.units import Length, Lengths, parse_length


def length(text: str) -> Length:
    """Parse a length with or without a unit.

    Parameters
    ----------
    text : str
        Such as ``120``, ``120mm`` or ``4.7in``.

    Returns
    -------
    Length

    Raises
    ------
    typer.BadParameter
        Where it is not a positive length.
    """
    try:
        return parse_length(text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def lengths(text: str) -> Lengths:
    """Parse lengths between commas.

    Parameters
    ----------
    text : str

    Returns
    -------
    Lengths

    Raises
    ------
    typer.BadParameter
        Where one of them is not a positive length.
    """
    return Lengths(tuple(length(part) for part in text.split(",")))


@dataclass(frozen=True)
class RodDiameters:
    """Diameters of rods as they are typed: one for all, or by family."""

    one: Optional[Length]
    by_family: tuple[tuple[str, Length], ...] = ()

    def in_unit(self, unit: str) -> Union[float, dict[str, float]]:
        """The diameters in the unit of a file; see `Length.in_unit`."""
        if self.one is not None:
            return self.one.in_unit(unit)
        return {family: size.in_unit(unit) for family, size in self.by_family}


def rod_diameters(text: str) -> RodDiameters:
    """Parse one diameter, or diameters of families between commas.

    Parameters
    ----------
    text : str
        Such as ``3mm`` or ``latitudinal=3mm,longitudinal=2mm``.

    Returns
    -------
    RodDiameters

    Raises
    ------
    typer.BadParameter
        Where a part is not a positive length, or a family is not known or named twice.
    """
    if "=" not in text:
        return RodDiameters(length(text))
    from weavecore.model import FAMILIES

    found: dict[str, Length] = {}
    for part in text.split(","):
        name, _, size = (piece.strip() for piece in part.partition("="))
        if name not in FAMILIES or name in found:
            raise typer.BadParameter(f"{part!r} does not name one of {', '.join(FAMILIES)} once: latitudinal=3mm")
        found[name] = length(size)
    return RodDiameters(None, tuple(found.items()))


@dataclass(frozen=True)
class Numbers:
    """Whole numbers from 0 on, as they are typed."""

    values: tuple[int, ...]


def numbers_of(text: str) -> Numbers:
    """Parse whole numbers between commas.

    Parameters
    ----------
    text : str

    Returns
    -------
    Numbers

    Raises
    ------
    typer.BadParameter
        Where a part has other characters than digits.
    """
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise typer.BadParameter(f"{text!r} is not a list of numbers; give them as weavecore info lists them: 0,2")
    return Numbers(tuple(int(part) for part in parts))


@dataclass(frozen=True)
class SpacingFactor:
    """A factor of the spacing near a point, as it is typed."""

    point: tuple[float, float, float]
    factor: float


def spacing_factor(text: str) -> SpacingFactor:
    """Parse a point and the factor of the spacing there.

    Parameters
    ----------
    text : str
        Four numbers between commas: ``0,0,300,0.5``.

    Returns
    -------
    SpacingFactor

    Raises
    ------
    typer.BadParameter
        Where they are not four finite numbers, or the factor is not positive.
    """
    try:
        x, y, z, factor = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = factor = -math.inf
    if not all(map(math.isfinite, (x, y, z, factor))) or factor <= 0:
        raise typer.BadParameter(f"{text!r} is not a point with a positive factor; give x,y,z,factor: 0,0,300,0.5")
    return SpacingFactor((x, y, z), factor)


@dataclass(frozen=True)
class Plane:
    """A plane as it is typed: a point and a normal."""

    numbers: tuple[float, ...]

    @property
    def point_and_normal(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Three coordinates each."""
        return self.numbers[:3], self.numbers[3:]


def plane_of(text: str) -> Plane:
    """Parse a plane from six numbers between commas.

    Parameters
    ----------
    text : str
        Point and normal: ``x,y,z,nx,ny,nz``.

    Returns
    -------
    Plane

    Raises
    ------
    typer.BadParameter
        Where they are not six finite numbers, or the normal is 0.
    """
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 6 or not all(abs(x) < float("inf") for x in numbers) or not any(numbers[3:]):
        raise typer.BadParameter(f"{text!r} is not a plane; give x,y,z,nx,ny,nz: a point and a normal that is not 0")
    return Plane(numbers)


def ends_with(ending: str) -> Callable[[Optional[Path]], Optional[Path]]:
    """Make a callback that refuses paths with another ending.

    Parameters
    ----------
    ending : str
        Such as ``".json"``; upper case in the path counts as lower case.

    Returns
    -------
    callable
        Of a path or None; returns it, or raises `typer.BadParameter`.
    """

    def check(path: Optional[Path]) -> Optional[Path]:
        if path is not None and path.suffix.lower() != ending:
            raise typer.BadParameter(f"{path} must end with {ending}")
        return path

    return check


def _known_by(module: str, find: str) -> Callable[[Optional[str]], Optional[str]]:
    """A callback that refuses names unknown to a function of a module, which is imported only then."""

    def check(name: Optional[str]) -> Optional[str]:
        if name is not None:
            try:
                getattr(import_module(module), find)(name)
            except Unsupported as error:
                raise typer.BadParameter(f"{error.what}. {error.remedy}") from error
        return name

    return check


known_pattern = _known_by("weavecore.linking.link", "known_pattern")
known_material = _known_by("weavecore.weaving.materials", "material_named")
known_style = _known_by("weavecore.weaving.layers", "style_named")


def known_method(name: str) -> str:
    """Check the name of a method of offsetting.

    Parameters
    ----------
    name : str

    Returns
    -------
    str
        The name.

    Raises
    ------
    typer.BadParameter
        Where there is no method of that name.
    """
    from weavecore.pipeline import METHODS

    if name not in METHODS:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(METHODS)}")
    return name


def known_side(name: Optional[str]) -> Optional[str]:
    """Check the name of a side.

    Parameters
    ----------
    name : str or None

    Returns
    -------
    str or None
        The name.

    Raises
    ------
    typer.BadParameter
        Where there is no side of that name.
    """
    if name not in (None, "outer"):
        raise typer.BadParameter(f"{name!r} is not outer")
    return name


# Whether a file can be read is found out by reading it: the error is one of the file then, not of usage.
Input = Annotated[Path, typer.Argument(metavar="INPUT", readable=False, help="A .3dm, .obj, .ply, .stl or .off file.")]
LayerNames = Annotated[
    Optional[list[str]],
    typer.Option(
        "--layer", metavar="NAME", help="Layer of the surface, such as Parent::Child; may be given several times."
    ),
]
ObjectNames = Annotated[
    Optional[list[str]],
    typer.Option("--object", metavar="NAME", help="Name or id of the surface; several are joined to one."),
]
EdgeTarget = Annotated[
    Optional[Length],
    typer.Option(
        "--edge-target",
        parser=length,
        metavar="LENGTH",
        help="Longest edge of the mesh that is made of a surface; by default from spacing and curvature.",
    ),
]
TimeLimit = Annotated[
    Optional[float],
    typer.Option(
        "--time-limit",
        min=1.0,
        metavar="SECONDS",
        help="Time limit; by default 115 for the command and 8 for reading, more for a large file.",
    ),
]
CutPlane = Annotated[
    Optional[Plane],
    typer.Option(
        parser=plane_of, metavar="X,Y,Z,NX,NY,NZ", help="Plane that cuts a closed surface in two: a point and a normal."
    ),
]
Borders = Annotated[
    Optional[Numbers],
    typer.Option(
        parser=numbers_of,
        metavar="NUMBERS",
        help="Borders that the rings start from, by their numbers in weavecore info: 0,2; by default all.",
    ),
]
SpacingFactors = Annotated[
    Optional[list[SpacingFactor]],
    typer.Option(
        "--spacing-at",
        parser=spacing_factor,
        metavar="X,Y,Z,FACTOR",
        help="Factor of the spacing near a point: 0,0,300,0.5 makes rings denser there, each by the mean along it; may "
        "be given several times.",
    ),
]
Reach = Annotated[
    Optional[Length],
    typer.Option(
        "--reach",
        parser=length,
        metavar="LENGTH",
        help="Distance at which a factor of --spacing-at has half of its effect; by default a quarter of the surface's "
        "extent.",
    ),
]
CurveNames = Annotated[
    Optional[list[str]],
    typer.Option(
        "--curve",
        metavar="NAME",
        help="Curve on the surface that rings start from on both sides, instead of the borders: name, id or layer of "
        "one in the file, or a .3dm with one curve, or a .csv, .txt or .xyz of points; may be given several times.",
    ),
]
Weld = Annotated[
    Optional[Length],
    typer.Option(
        "--weld",
        parser=length,
        metavar="LENGTH",
        help="Weld vertices of borders that are no further apart than this; by default the file's tolerance, or a "
        "millionth of the size.",
    ),
]
FillHoles = Annotated[
    Optional[Length],
    typer.Option(
        "--fill-holes", parser=length, metavar="LENGTH", help="Close holes whose border is no longer than this."
    ),
]
Largest = Annotated[bool, typer.Option("--largest", help="Take only the piece with the largest area.")]
Side = Annotated[
    Optional[str],
    typer.Option("--side", metavar="outer", callback=known_side, help="Take only the outer side of a thin solid."),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Refuse doubtful surfaces and results, instead of noting the doubt.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
TieStrength = Annotated[
    float,
    typer.Option("--tie-strength", metavar="N", help="What a cable tie carries, in N; by default one 2.5 mm wide."),
]
