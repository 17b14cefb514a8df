"""Takes the surface that is to be woven."""

from weavecore import canvas


def compute(run, geometry, layer, name, edge, plane, weld, fill_holes, largest, side):
    chosen = {"layer": layer, "name": name, "edge": edge, "plane": plane}
    repairs = {"weld": weld, "fill_holes": fill_holes, "largest": largest, "side": side}
    surface = canvas.read_geometry(run, geometry, **chosen, **repairs)
    borders, mesh = canvas.draw_surface(run, surface)
    doubts, places = canvas.draw_doubts(run, surface)
    run.caption = canvas.counts(face=surface.n_faces, border=len(borders))
    return surface, borders, mesh, canvas.report_lines(surface), doubts, places


class Surface(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(
        self,
        geometry,
        layer: str,
        name: str,
        edge: float,
        plane: Rhino.Geometry.Plane,
        weld: float,
        fill_holes: float,
        largest: bool,
        side: str,
    ):
        inputs = {"geometry": geometry, "layer": layer, "name": name, "edge": edge, "plane": plane}
        inputs.update({"weld": weld, "fill_holes": fill_holes, "largest": largest, "side": side})
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"geometry": object}, n_outputs=6)
