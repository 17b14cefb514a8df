"""Puts the rods into the document, with layers, names, colours and user text."""

from weavecore import canvas


def compute(run, weave, layer, bake):
    canvas.report_lines(weave)
    ids = canvas.bake_rods(run, weave, layer) if bake else None
    run.caption = canvas.counts(rod=len(ids)) + " baked" if ids else ""
    return (ids,)


class Bake(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, weave, layer: str, bake: bool):
        inputs = {"weave": weave, "layer": layer, "bake": bake}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(
            component, sticky, compute, inputs, needs={"weave": object}, buttons=["bake"], is_kept=False, n_outputs=1
        )
