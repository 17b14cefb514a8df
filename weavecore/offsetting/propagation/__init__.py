"""Front propagation, the paper's own method (`fronts`): polylines are offset step by step and uncrossed (§4)."""
