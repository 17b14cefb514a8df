"""Measures a result, and checks that it keeps what it promises."""

import weavecore as wc
from weavecore import canvas


def compute(run, value):
    run.progress(0.0, "measuring")
    unit = canvas.unit_of(run, value) if isinstance(value, wc.Weave) else None
    measures = canvas.measure(value, unit)
    run.progress(0.5, "checking")
    findings = canvas.check(run, value)
    run.caption = canvas.measures_caption(measures)
    edges = None if measures.edges is None else measures.edges.tolist()
    figures = measures.regular, measures.least_radius, measures.utilisation
    sums = measures.length, measures.n_joints, measures.waste, measures.mass
    return (measures.spacing.tolist(), edges, *figures, findings, *sums)


class Measure(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, value):
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, {"value": value}, needs={"value": object}, n_outputs=10)
