"""From a `Weave` to what a workshop needs: tables, pieces, marks, templates and a report.

All lengths in here are millimetres, whatever the model's unit.  Words: a *rod* is a strand; a *piece* is what is
cut for it from one bar of *stock*; a *splice* joins two pieces, or the ends of a ring; a *mark* is
where a rod passes a node, a *tick* is the mark on a piece.
"""
