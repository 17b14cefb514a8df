from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix, diags, identity, kron

from weavecore.polling import listening
from weavecore.simulating.factors import factorise

MEMORY = Path("/proc/self/statm")


def grid(n: int, shift: float = 0.0) -> csc_matrix:
    line = diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(n, n))
    return (kron(line, identity(n)) + kron(identity(n), line) - shift * identity(n * n)).tocsc()


def test_factors_solve_and_count_the_negative_eigenvalues() -> None:
    matrix = grid(6, shift=1.0)
    right = np.linspace(0.0, 1.0, 36)
    factors = factorise(matrix)
    assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-10
    assert factors.n_negative == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum() > 0


def test_a_matrix_without_an_inverse_is_refused_where_its_factors_are_asked_for() -> None:
    with pytest.raises(RuntimeError, match="singular"):
        factorise(csc_matrix(np.zeros((2, 2))))


@pytest.mark.skipif(not MEMORY.exists(), reason="the memory of the process is read from /proc")
def test_factors_that_are_dropped_while_the_caller_polls_leave_no_memory_behind() -> None:
    matrix = grid(60)

    def pages() -> int:
        return int(MEMORY.read_text("ascii").split()[1])

    with listening(lambda _fraction, _label: None):
        for _ in range(5):
            factorise(matrix)
        before = pages()
        for _ in range(40):
            factorise(matrix)
    assert (pages() - before) * 4096 < 25e6


def test_the_thread_that_makes_factors_ends_before_what_was_loaded_before_it() -> None:
    program = """
import atexit, threading
atexit.register(lambda: print([thread.name for thread in threading.enumerate()]))
from scipy.sparse import identity
from weavecore.simulating.factors import factorise
factorise(identity(3).tocsc())
print([thread.name for thread in threading.enumerate()])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["['MainThread', 'factors']", "['MainThread']"]
