"""Stage 2: from a surface to the closed polylines parallel to its borders."""
