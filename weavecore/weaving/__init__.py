"""Stage 4: from the lattice to the rods."""
