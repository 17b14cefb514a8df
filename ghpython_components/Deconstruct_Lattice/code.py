"""Takes a lattice apart: nodes, edges by family, faces and borders."""

import weavecore as wc
from weavecore import canvas


def compute(run, lattice):
    run.caption = canvas.counts(node=lattice.n_nodes, edge=lattice.n_edges, face=lattice.n_faces)
    return tuple(canvas.draw_lattice_parts(run, lattice))


class DeconstructLattice(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, lattice):
        inputs = {"lattice": lattice}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"lattice": wc.Lattice}, n_outputs=8)
