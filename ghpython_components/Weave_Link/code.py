"""Divides the latitudes and binds them to a lattice."""

import weavecore as wc
from weavecore import canvas


def compute(run, latitudes, edge, pattern, free_rings):
    options = {"edge_length": edge, "pattern": canvas.plain(pattern) or "triangular", "free_rings": bool(free_rings)}
    lattice = wc.link(latitudes, **options, progress=run.progress)
    canvas.warn_of_doubts(run, lattice.latitudes.surface, known=latitudes.surface.notes)
    drawn = canvas.draw_lattice(run, lattice)
    run.caption = canvas.counts(node=lattice.n_nodes, edge=lattice.n_edges)
    return lattice, drawn.nodes, drawn.rings, drawn.longitudes, drawn.pockets, drawn.mesh


class Link(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, latitudes, edge: float, pattern: str, free_rings: bool):
        inputs = {"latitudes": latitudes, "edge": edge, "pattern": pattern, "free_rings": free_rings}
        options = {"needs": {"latitudes": wc.Latitudes}, "n_outputs": 6, "lists": canvas.lists_of("pattern")}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
