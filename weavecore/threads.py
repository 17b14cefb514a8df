"""Threads of the libraries of linear algebra, which read these variables when they are loaded.

What weavecore computes gains nothing from them: they cost processor time, and a process that has them cannot be copied.
"""

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment that limit them."""
