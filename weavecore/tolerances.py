"""Named tolerances that several stages share.

Each is a part of a length that its text names (an edge, the spacing), so that none depends on the model's unit.
"""

LEVEL_FROM_VERTEX = 1e-4
"""Of an edge: a polyline crosses it no nearer to its ends.  Far above rounding, far below what can be seen."""

LEVEL_ROUNDING = 1e-9
"""Of the spacing: a vertex so little below a level counts as on it, and so as beyond it."""

MIN_CAP_RISE = 0.04
"""Of the spacing: a child that encloses nothing deeper is dropped.  Keeping it would add a loop around a speck;
dropping it leaves a gap of at most 1.04 spacings."""

MIN_CUT_LOCUS_RISE = 0.03
"""Of the spacing: a cut locus vertex or saddle that rises less above a level is lowered beneath it, so that the
polylines on its two sides keep apart.  Less than `MIN_CAP_RISE`: scraps that this leaves are dropped."""

MIN_FREE_BORDER_GAP = 0.35
"""Of the spacing: a polyline beyond which a free border follows nearer than this is left out; no rod has room there."""

CUT_FROM_VERTEX = 0.06
"""Of an edge: the cut of a closed surface passes through a vertex that is nearer than this, and crosses an edge no
nearer to its ends; so it leaves no slivers."""

LEAST_CUT_OFF = 0.02
"""Of the surface's area: a closed surface that is cut by itself loses no piece smaller than this."""

CLASH = 0.02
"""Of a rod's diameter: axes of two rods that are nearer than a diameter by more than this clash."""
