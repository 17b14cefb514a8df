"""File formats: one reader a format."""
