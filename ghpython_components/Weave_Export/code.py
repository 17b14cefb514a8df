"""Writes the result of any stage to a file, by the file's ending."""

from weavecore import canvas


def compute(run, value, path, write, overwrite):
    report = canvas.report_lines(value)
    if write and path is None:
        run.warn("There is no file to write to. Wire its name to path.")
    if not write or path is None:
        run.caption = "not written"
        return None, report
    target = canvas.write_value(run, value, path, overwrite=bool(overwrite))
    run.caption = "written"
    return target, report


class Export(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, value, path: str, write: bool, overwrite: bool):
        inputs = {"value": value, "path": path, "write": write, "overwrite": overwrite}
        options = {"needs": {"value": object}, "n_outputs": 2, "is_kept": False, "buttons": ["write"]}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
