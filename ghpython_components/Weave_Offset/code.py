"""Moves the borders inwards, again and again by the same distance, until they fill the surface."""

import weavecore as wc
from weavecore import canvas


def compute(run, surface, spacing, method, borders, guides, points, factors, reach):
    latitudes = wc.offset(
        surface,
        spacing=canvas.numbers(spacing),
        method=canvas.plain(method) or "levels",
        borders=canvas.chosen(run, borders, surface),
        curves=canvas.read_curves(run, guides),
        factors=canvas.read_factors(points, factors),
        reach=reach,
        progress=run.progress,
    )
    canvas.warn_of_doubts(run, latitudes.surface, known=surface.notes)
    canvas.remark_of_grading(run, latitudes.surface)
    drawn = canvas.draw_latitudes(run, latitudes)
    run.caption = canvas.counts(curve=len(latitudes), generation=latitudes.n_generations)
    return latitudes, drawn.curves, drawn.parents


class Offset(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(
        self,
        surface,
        spacing: System.Collections.Generic.List[float],
        method: str,
        borders: System.Collections.Generic.List[object],
        guides: System.Collections.Generic.List[object],
        points: System.Collections.Generic.List[object],
        factors: System.Collections.Generic.List[float],
        reach: float,
    ):
        inputs = {"surface": surface, "spacing": spacing, "method": method, "borders": borders, "guides": guides}
        inputs.update(points=points, factors=factors, reach=reach)
        options = {"needs": {"surface": wc.SurfaceMesh}, "n_outputs": 3, "lists": canvas.lists_of("method")}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
