"""The Python packages that the plugin brings along, as the files of the folder ``weavecore_library``.

The package weavecore lies there itself.  NumPy and SciPy can be added from their wheels, in a folder for each kind of
machine, named as ``platform.machine()`` names it: then nothing is left to be installed, and no network is needed.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

FOLDER = "weavecore_library"

_LEFT_OUT = {"__pycache__"}
_METADATA = "Metadata-Version: 2.1\nName: weavecore\nVersion: {version}\n"
_MACHINES = {"amd64": "amd64", "x86_64": "x86_64", "arm64": "arm64", "aarch64": "aarch64"}
"""Ends of a wheel's platform tag, and what ``platform.machine()`` says there, in lower case."""


def library_files(package: Path, version: str, wheels: Iterable[Path] = ()) -> dict[str, bytes]:
    """The files of the folder by their paths.

    Parameters
    ----------
    package : Path
        The folder of the package weavecore.
    version : str
    wheels : iterable of Path
        Wheels of NumPy and SciPy for Python 3.9.
    """
    sources = (path for path in sorted(package.rglob("*")) if path.is_file() and not _LEFT_OUT & set(path.parts))
    files = {f"{FOLDER}/weavecore/{path.relative_to(package).as_posix()}": path.read_bytes() for path in sources}
    files[f"{FOLDER}/weavecore-{version}.dist-info/METADATA"] = _METADATA.format(version=version).encode("utf-8")
    for wheel in sorted(wheels):
        files.update(_unpacked(wheel))
    return files


def _unpacked(wheel: Path) -> dict[str, bytes]:
    """What a wheel holds but its own tests, which are half of SciPy."""
    home = f"{FOLDER}/{machine_of(wheel.name)}"
    with zipfile.ZipFile(wheel) as content:
        names = [name for name in content.namelist() if not name.endswith("/") and "/tests/" not in name]
        return {f"{home}/{name}": content.read(name) for name in names}


def machine_of(name: str) -> str:
    """The kind of machine that a wheel is for.

    Raises
    ------
    ValueError
        Where its name does not end in a known one.
    """
    tag = name[: -len(".whl")].rpartition("-")[2]
    found = re.search(f"({'|'.join(_MACHINES)})$", tag)
    if not found:
        raise ValueError(f"{name} is not a wheel for one kind of machine")
    return _MACHINES[found[1]]


def system_of(wheels: Iterable[Path]) -> str:
    """The system that a package with these wheels is for, as the package manager names it: win, mac or any."""
    tags = [wheel.stem.rpartition("-")[2] for wheel in wheels]
    for system, start in (("win", "win"), ("mac", "macosx")):
        if tags and all(tag.startswith(start) for tag in tags):
            return system
    return "any"
