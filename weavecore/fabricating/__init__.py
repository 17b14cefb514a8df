"""Stage after `Weave`: the folder that a workshop builds from, with tables, templates and a report.

All lengths in here are millimetres, whatever the model's unit.  A *rod* is a strand of the weave; a *piece* is what is
cut for it from one bar of *stock*; a *splice* joins two pieces, or the ends of a ring; a *mark* is
where a piece passes a node of the lattice, drawn as a *tick* on the template.
"""
