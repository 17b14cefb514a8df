"""Stage 5: results to files, one writer a file ending."""
