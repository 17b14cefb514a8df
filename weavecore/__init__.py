"""weavecore turns a freeform surface into a structure woven from rods.

>>> import weavecore as wc
>>> surface = wc.read_surface("shell.3dm", layer="Shell")
>>> latitudes = wc.offset(surface, spacing=120.0)
>>> lattice = wc.link(latitudes)
>>> weave = wc.weave(lattice, rod_diameter=5.0)
>>> wc.export(lattice, "woven.3dm")

Each verb takes the value of the one before and gives a new one that does not change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weavecore.errors import UnitUnknown, WeaveError
    from weavecore.model import Latitudes, Lattice, Material, Strands, SurfaceMesh, Weave
    from weavecore.pipeline import (
        Workshop,
        compensate,
        draw_picture,
        export,
        fabricate,
        inspect_file,
        link,
        offset,
        read_result,
        read_surface,
        replay,
        simulate,
        suggest_spacing,
        surface_from,
        validate,
        weave,
    )

    __version__: str

__all__ = [
    "Latitudes",
    "Lattice",
    "Material",
    "Strands",
    "SurfaceMesh",
    "UnitUnknown",
    "Weave",
    "WeaveError",
    "Workshop",
    "__version__",
    "compensate",
    "draw_picture",
    "export",
    "fabricate",
    "inspect_file",
    "link",
    "offset",
    "read_result",
    "read_surface",
    "replay",
    "simulate",
    "suggest_spacing",
    "surface_from",
    "validate",
    "weave",
]

_HOMES = {
    "weavecore.errors": ("UnitUnknown", "WeaveError"),
    "weavecore.model": ("Lattice", "Latitudes", "Material", "Strands", "SurfaceMesh", "Weave"),
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for: the command must answer ``--help`` before SciPy has loaded."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "__version__":
        from weavecore.version import installed_version

        return installed_version()
    from importlib import import_module

    home = next((module for module, names in _HOMES.items() if name in names), "weavecore.pipeline")
    value = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
