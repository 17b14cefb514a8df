"""Shows the rods as coloured pipes, up to a step of the construction."""

from weavecore import canvas


def compute(run, weave, colour, step, amplitude):
    drawn = canvas.draw_preview(run, weave, colour=colour, step=step, amplitude=amplitude)
    run.caption = canvas.counts(rod=len(drawn.names))
    return tuple(drawn)


class Preview(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, weave, colour: str, step: int, amplitude: float):
        inputs = {"weave": weave, "colour": colour, "step": step, "amplitude": amplitude}
        options = {"needs": {"weave": object}, "n_outputs": 5, "lists": canvas.lists_of("colour")}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
