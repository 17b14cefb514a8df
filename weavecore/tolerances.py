"""Named tolerances, one home.

Lengths are relative to what each name says, so that nothing hangs on the model's unit.
"""

LEVEL_FROM_VERTEX = 1e-4
"""A polyline crosses an edge no nearer to its ends than this part of the edge."""

LEAST_CAP = 0.04
"""A child that encloses nothing deeper than this part of the spacing is dropped: keeping it
would add a loop about a speck, dropping it leaves a gap of at most 1.04 spacings."""
