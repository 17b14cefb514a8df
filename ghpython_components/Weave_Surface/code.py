"""Takes the surface that is to be woven."""

from weavecore import canvas


def compute(run, geometry, layer, name, edge, plane):
    surface = canvas.read_geometry(run, geometry, layer=layer, name=name, edge=edge, plane=plane)
    borders, mesh = canvas.draw_surface(run, surface)
    run.caption = canvas.counts(face=surface.n_faces, border=len(borders))
    return surface, borders, mesh, canvas.report_lines(surface)


class Surface(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, geometry, layer: str, name: str, edge: float, plane: Rhino.Geometry.Plane):
        inputs = {"geometry": geometry, "layer": layer, "name": name, "edge": edge, "plane": plane}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"geometry": object}, n_outputs=4)
