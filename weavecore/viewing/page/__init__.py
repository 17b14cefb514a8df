"""The page: a stage's result as one HTML file that needs nothing else."""
