# r: weavecore>=0.1
# venv: weavecore
"""Moves the borders inwards, again and again by the same distance, until they fill the surface."""

import Grasshopper
import scriptcontext

import weavecore as wc
from weavecore import canvas


def compute(run, surface, spacing, method):
    spacings = canvas.numbers(spacing)
    latitudes = wc.offset(surface, spacing=spacings, method=method or "levels", progress=run.progress)
    drawn = canvas.draw_latitudes(run, latitudes)
    run.caption = canvas.counts(curve=len(latitudes), generation=latitudes.n_generations)
    return latitudes, drawn.curves, drawn.parents


class Offset(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, surface, spacing, method: str):
        inputs = {"surface": surface, "spacing": spacing, "method": method}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"surface": wc.SurfaceMesh}, n_outputs=3)
