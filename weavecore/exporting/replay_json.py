"""The replay of a building sequence as JSON: one object, indices from 0, lengths in the model's unit, stresses in MPa.

::

    format "weavecore replay", version 1, unit, supports, loads
    steps [{step, rods, displacement, node, stress, utilisation, rod, converged}…]   rising
    worst {displacement, stress}                                                     rows of steps
    sequence [rod…]                                                                  in the order in which they are set
    spread [generation…]                                       those whose rods are set far from each other in turn
"""

from __future__ import annotations

import json
from typing import Any

from weavecore.model import Replay

FORMAT, VERSION = "weavecore replay", 1


def encode_replay(found: Replay) -> bytes:
    """Write a replay.

    Parameters
    ----------
    found : Replay

    Returns
    -------
    bytes
    """
    weave = found.weave
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "unit": weave.lattice.latitudes.surface.unit,
        "supports": found.supports,
        "loads": found.loads,
        "steps": [
            {
                "step": int(found.step[k]),
                "rods": int(found.n_rods[k]),
                "displacement": float(found.displacement[k]),
                "node": int(found.node[k]) if found.node[k] >= 0 else None,
                "stress": float(found.stress[k]),
                "utilisation": float(found.utilisation[k]),
                "rod": weave.ids[found.rod[k]] if found.rod[k] >= 0 else None,
                "converged": bool(found.is_converged[k]),
            }
            for k in range(len(found))
        ],
        "worst": {"displacement": found.worst, "stress": found.most_stressed},
        "sequence": [weave.ids[s] for s in found.strand.tolist()],
        "spread": list(found.spread),
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
