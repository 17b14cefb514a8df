"""Where the nodes are, from the marks and the axes alone.

At a node each rod lies its ``layer_offset`` out of the surface along one normal: p = node + offset · n.  Two rods at
different heights tell both; a rod that is alone lies on the node.
"""

from __future__ import annotations

import numpy as np

from weavecore.fabricating.report_files import Axes, ReadTable
from weavecore.geometry.arrays import Floats


def rebuild_nodes(marks: ReadTable, axes: Axes) -> tuple[list[str], Floats]:
    """Names of the joints and nodes that the marks tell of, sorted, and where they are (n, 3).

    A joint all rods of which lie at one height is not a number.
    """
    joints = [*marks["joint_id"], *(joint for joint, other in zip(marks["joint_id"], marks["other_rod"]) if other)]
    rods = [*marks["rod_id"], *(other for other in marks["other_rod"] if other)]
    other = marks.floats("other_station")
    stations = np.concatenate([marks.floats("station"), other[~np.isnan(other)]])
    # A joint's rods are named by several marks; each counts once.
    known = sorted(set(zip(joints, rods, stations.tolist())))
    names, group = np.unique([joint for joint, _, _ in known], return_inverse=True)
    rows = axes.rows_at([rod for _, rod, _ in known], np.array([station for _, _, station in known]))
    point, height = axes.point[rows], axes.layer_offset[rows]
    n = len(names)
    weight = np.bincount(group, minlength=n)
    mean_height = np.bincount(group, height, minlength=n) / weight
    mean_point = np.stack([np.bincount(group, point[:, k], minlength=n) / weight for k in range(3)], axis=1)
    rise = height - mean_height[group]
    spread = np.bincount(group, rise * rise, minlength=n)
    climb = np.stack([np.bincount(group, rise * point[:, k], minlength=n) for k in range(3)], axis=1)
    flat = spread < 1e-6
    normal = np.divide(climb, spread[:, None], out=np.zeros_like(climb), where=~flat[:, None])
    # Without a difference of heights the nodes are known only where the rods lie on them.
    nodes = mean_point - mean_height[:, None] * normal
    nodes[flat & (np.abs(mean_height) > 1e-6)] = np.nan
    return names.tolist(), nodes
