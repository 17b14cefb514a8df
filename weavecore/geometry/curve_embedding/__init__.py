"""A curve embedded in a triangle mesh: it becomes a path of edges, and the surface stays the same."""
