"""Takes a weave apart: rods by family, joints, over and under, and lines for other programs."""

import weavecore as wc
from weavecore import canvas


def compute(run, weave):
    run.caption = canvas.counts(rod=len(weave), joint=len(weave.joints))
    return tuple(canvas.draw_weave_parts(run, weave))


class DeconstructWeave(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, weave):
        inputs = {"weave": weave}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"weave": wc.Weave}, n_outputs=13)
