"""Takes a variant from the table of an exploration."""

from weavecore import canvas


def compute(run, table, row, spacing):
    run.progress(0.0, "reading the table")
    chosen = canvas.choose_row(run, table, row, spacing)
    run.caption = "no table" if chosen.reason is None else chosen.reason.partition(":")[0]
    return tuple(chosen)


class Choose(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, table: str, row: int, spacing: float):
        inputs = {"table": table, "row": row, "spacing": spacing}
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, needs={"table": str}, n_outputs=8, is_kept=False)
