"""Lays rods over and under each other along the lattice."""

import weavecore as wc
from weavecore import canvas


def compute(run, lattice, diameter, material, style, stock):
    layout = run.part(canvas.lay_out_rods, lattice, canvas.style_or_none(style))
    weave = wc.weave(
        layout.lattice,
        rod_diameter=diameter,
        stock=canvas.diameters(stock),
        material=canvas.plain(material) or "gfrp",
        layout=layout,
        progress=run.progress,
    )
    drawn = canvas.draw_rods(run, weave)
    run.caption = f"{canvas.counts(rod=len(weave))}, {weave.over_under}"
    for text in canvas.concerns(weave):
        run.warn(text)
    return weave, drawn.rods, drawn.names, drawn.layers, drawn.utilisation


class Strands(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(
        self, lattice, diameter: float, material: str, style: str, stock: System.Collections.Generic.List[float]
    ):
        inputs = {"lattice": lattice, "diameter": diameter, "material": material, "style": style, "stock": stock}
        options = {"needs": {"lattice": wc.Lattice}, "n_outputs": 5, "lists": canvas.lists_of("material", "style")}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
