"""Finds where the rods come to rest, and the forces in them."""

import weavecore as wc
from weavecore import canvas


def compute(run, weave, supports, places, gravity, pressure, points, forces):
    held = canvas.read_places(run, places) or canvas.plain(supports) or "borders"
    loads = canvas.read_loads(points, forces)
    options = {"gravity": gravity, "pressure": pressure or 0.0, "forces": loads, "unit": canvas.unit_of(run, weave)}
    at_rest = wc.simulate(weave, supports=held, **options, progress=run.progress)
    run.caption = canvas.equilibrium_caption(at_rest)
    for text in canvas.equilibrium_concerns(at_rest):
        run.warn(text)
    return (at_rest, *canvas.draw_equilibrium(run, at_rest))


class Simulate(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(
        self,
        weave,
        supports: str,
        places: System.Collections.Generic.List[object],
        gravity: bool,
        pressure: float,
        points: System.Collections.Generic.List[object],
        forces: System.Collections.Generic.List[object],
    ):
        inputs = {"weave": weave, "supports": supports, "places": places, "gravity": gravity, "pressure": pressure}
        inputs.update(points=points, forces=forces)
        options = {"needs": {"weave": wc.Weave}, "n_outputs": 11, "lists": canvas.lists_of("supports")}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
