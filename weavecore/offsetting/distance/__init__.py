"""Exact geodesic distance from the borders: window propagation along rays, then relaxation."""
