"""Opens a result as a page in the browser."""

from weavecore import canvas


def compute(run, value, path, show):
    canvas.report_lines(value)
    run.caption = "opened" if show else ""
    return (canvas.open_page(run, value, path) if show else None,)


class View(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, value, path: str, show: bool):
        inputs = {"value": value, "path": path, "show": show}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(
            component, sticky, compute, inputs, needs={"value": object}, buttons=["show"], is_kept=False, n_outputs=1
        )
