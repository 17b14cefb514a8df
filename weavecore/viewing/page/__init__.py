"""A stage's result as one interactive HTML file."""
