"""The origins in a JSON result: the paths along edges from which distances start."""

from __future__ import annotations

import numpy as np

from weavecore.model import Origins
from weavecore.reading.result_part import ResultPart, damaged_result


def take_origins(surface: ResultPart, n_vertices: int) -> Origins:
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
