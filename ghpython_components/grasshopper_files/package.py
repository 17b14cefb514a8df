"""The package for Rhino's package manager, Yak: a zip with ``manifest.yml`` on top."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

_MANIFEST = """\
---
name: weavecore
version: {version}
authors:
- The weavecore authors
description: >
  Grasshopper components that turn a freeform surface into a structure woven from rods:
  surface, offset, link, strands, simulate, fabricate, export. They run in Rhino 8 and bring
  the Python package weavecore along; NumPy and SciPy are installed when they are first used.
icon: icon.png
keywords:
- weaving
- remeshing
- geodesic offset
- rods
- grasshopper
"""
_DATE = (1980, 1, 1, 0, 0, 0)
_READABLE = 0o100644 << 16


def encode_package(version: str, icon: bytes, files: Mapping[str, bytes]) -> bytes:
    """The bytes of a ``.yak``.

    Parameters
    ----------
    version : str
    icon : bytes
        A .png of 64 by 64 pixels.
    files : mapping of str to bytes
        What lies beside the manifest, by its path.
    """
    manifest = _MANIFEST.format(version=version).encode("utf-8")
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as package:
        for name, body in {"manifest.yml": manifest, "icon.png": icon, **files}.items():
            # The date and the rights are fixed, so that the same files give the same bytes.
            entry = zipfile.ZipInfo(name, _DATE)
            entry.external_attr, entry.create_system = _READABLE, 3
            entry.compress_type = zipfile.ZIP_DEFLATED
            package.writestr(entry, body, compresslevel=9)
    return content.getvalue()
