"""Stage 3: from the latitudes to the lattice."""
