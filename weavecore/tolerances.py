"""Named tolerances, one home.

Lengths are relative to what each name says, so that nothing hangs on the model's unit.
"""

LEVEL_FROM_VERTEX = 1e-4
"""A polyline crosses an edge no nearer to its ends than this part of the edge."""

LEAST_CAP = 0.04
"""A child that encloses nothing deeper than this part of the spacing is dropped: keeping it
would add a loop about a speck, dropping it leaves a gap of at most 1.04 spacings."""

LEAST_HEM = 0.35
"""A polyline beyond which a selvedge follows nearer than this part of the spacing is left out."""

LEAST_NECK = 0.03
"""A ridge that rises less than this part of the spacing above a level is put below it, so that the
polylines on its two sides keep apart.  Less than `LEAST_CAP`: scraps that a cut leaves are dropped."""

LEVEL_REACHED = 1e-9
"""A vertex this part of the spacing below a level counts as on it, and so as beyond it."""

CUT_FROM_VERTEX = 0.06
"""The cut of a closed surface goes through a vertex where it comes nearer to it than this part of
an edge, and crosses an edge no nearer to its ends: so it leaves no slivers."""

LEAST_CUT_OFF = 0.02
"""A closed surface that is cut by itself loses no piece smaller than this part of its area."""
