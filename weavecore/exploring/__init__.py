"""Many variants of a weave: woven on all processors or a cluster, measured, and chosen from.

A *variant* is a surface with a choice of borders, spacing, pattern, rod and material.  `explore` weaves all of a grid
into a folder with a table, pictures and a page; `choose_variant` names the best.
"""

from weavecore.exploring.choose import Choice, choose_variant, describe_row
from weavecore.exploring.exploration import Exploration, explore
from weavecore.exploring.table import Row, read_rows

__all__ = ["Choice", "Exploration", "Row", "choose_variant", "describe_row", "explore", "read_rows"]
