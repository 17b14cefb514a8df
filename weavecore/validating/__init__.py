"""Checks what each stage gives against what must always hold."""
