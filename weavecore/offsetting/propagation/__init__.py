"""The paper's own method: each polyline is offset by a step, and what crosses is taken apart (§4.1 to §4.6)."""
