"""Cuts the rods: pieces laid out straight with their marks, the cut list, and the folder for the workshop."""

import weavecore as wc
from weavecore import canvas


def compute(run, weave, stock, splice, folder, write, overwrite):
    options = {"stock": stock, "splice": splice, "folder": folder, "write": write, "overwrite": bool(overwrite)}
    made = canvas.draw_cut_list(run, weave, **options)
    run.caption = canvas.counts(piece=len(made.names)) + (", written" if made.folder else "")
    return tuple(made)


class Fabricate(Grasshopper.Kernel.GH_ScriptInstance):
    def RunScript(self, weave, stock: float, splice: str, folder: str, write: bool, overwrite: bool):
        inputs = {
            "weave": weave,
            "stock": stock,
            "splice": splice,
            "folder": folder,
            "write": write,
            "overwrite": overwrite,
        }
        options = {
            "needs": {"weave": wc.Weave},
            "buttons": ["write"],
            "n_outputs": 9,
            "lists": canvas.lists_of("splice"),
        }
        component, sticky = ghenv.Component, scriptcontext.sticky
        return canvas.solve(component, sticky, compute, inputs, **options)
