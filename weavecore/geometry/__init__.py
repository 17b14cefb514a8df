"""Pure functions on arrays: no weaving words, no state, no files."""
