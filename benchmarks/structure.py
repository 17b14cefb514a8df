"""The structural stage on all samples: ``python benchmarks/structure.py [SAMPLE…] [--within MM]`` prints a table.

Each sample is woven in three patterns with the options that are suggested, and comes to rest twice: with its borders
held under its own weight, and released without supports or loads.  Departure is of the nodes, in millimetres; its share
is the mean over the diagonal of the bounding box.  A row that did not converge gives the residual force.  With
``--within``, a third row holds few nodes, so that under self-weight none departs by more.  ``--compensate`` prints
another table: released weaves before and after compensation of their marks, with the limit of ``--within`` or 2 mm.
``--halving`` prints how the mean departure changes when the segments are halved, ``--sequence`` the largest
displacement of the unfinished weave in millimetres, with its borders held, before and after the sequence is improved.
"""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import time
from pathlib import Path

import numpy as np

import weavecore as wc
from weavecore.errors import WeaveError
from weavecore.simulating.discretise import place_points
from weavecore.structural_analysis import replay
from weavecore.units import millimetres_in

SAMPLES = Path(__file__).resolve().parents[1] / "sample_files"
PATTERNS = ("triangular", "plain", "kagome")
COLUMNS = (
    "sample", "pattern", "supports", "unknowns", "departure mean", "95%", "max", "share", "energy drawn", "at rest",
    "stress MPa", "utilisation", "tie N", "stable", "steps", "seconds",
)  # fmt: skip
COMPENSATED = (
    "sample", "pattern", "mean before", "max", "mean after", "max", "nodes held", "of", "verdict", "marks move, max",
    "utilisation before", "after", "stable", "seconds",
)  # fmt: skip
HALVED = (
    "sample", "pattern", "supports", "segments", "departure mean", "halved", "change", "stress MPa", "halved",
    "seconds", "halved",
)  # fmt: skip
REPLAYED = (
    "sample", "pattern", "rods", "displacement, max", "without equilibrium", "improved", "without equilibrium",
    "generations spread", "seconds", "improved",
)  # fmt: skip
MOST_SECONDS = 150.0
"""Of processor time that one compensation may take."""


def main() -> None:
    """Print the table as Markdown, each row when it is known."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("samples", nargs="*", default=sorted(path.stem for path in SAMPLES.glob("*.3dm")))
    parser.add_argument("--segments", type=int, default=2)
    parser.add_argument("--within", type=float, metavar="MM")
    parser.add_argument("--patterns", default=",".join(PATTERNS))
    parser.add_argument("--compensate", action="store_true")
    parser.add_argument("--halving", action="store_true")
    parser.add_argument("--sequence", action="store_true")
    options = parser.parse_args()
    columns = HALVED if options.halving else REPLAYED if options.sequence else COLUMNS
    columns = COMPENSATED if options.compensate else columns
    print("| " + " | ".join(columns) + " |")
    print("|" + "---|" * len(columns), flush=True)
    for sample in options.samples:
        latitudes = wc.offset(wc.read_surface(SAMPLES / f"{sample}.3dm"))
        for pattern in options.patterns.split(","):
            weave = wc.weave(wc.link(latitudes, pattern=pattern))
            if options.compensate or options.sequence:
                row = compensated_row(weave, options.within) if options.compensate else replayed_row(weave)
                print("| " + " | ".join([sample, pattern, *row]) + " |", flush=True)
                continue
            for supports in ("borders", "none", *(["within"] if options.within else [])):
                if options.halving:
                    row = halved_row(weave, supports, options.segments)
                    print("| " + " | ".join([sample, pattern, *row]) + " |", flush=True)
                    continue
                row = row_of(weave, supports, options.segments, options.within)
                print("| " + " | ".join([sample, pattern, *row]) + " |", flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"\nPeak memory {peak:,.0f} MB; NumPy {np.__version__}, Python {sys.version.split()[0]}.")


def row_of(weave: wc.Weave, supports: str, segments: int, within: float | None = None) -> list[str]:
    """One row from the supports on; seconds are of this process, so that others on the machine do not count."""
    surface = weave.lattice.latitudes.surface
    unit = millimetres_in(surface.unit)
    held = supports == "borders" and bool(weave.is_border_node.any())
    begun = time.process_time()
    try:
        if supports == "within":
            found = wc.simulate(weave, within=within / unit, segments=segments)
            supports = f"{int(found.is_supported.sum())} of {len(found.is_supported)} nodes"
        else:
            found = wc.simulate(weave, supports=supports if held else "none", segments=segments)
        state = "yes" if found.is_stable else f"no, {found.n_negative}"
    except WeaveError as error:
        found = getattr(error, "reached", None)
        if found is None:
            return [supports, error.code]
        state = f"**not converged**, {found.residual:.1g} N"
    seconds = time.process_time() - begun
    move = found.departure_mean * unit, found.departure_p95 * unit, found.departure_max * unit
    n = 3 * len(place_points(weave.axes, segments=segments, metres=1.0).points)
    return [
        "no border" if supports == "borders" and not held else supports,
        f"{n:,}",
        *(f"{one:.3g}" for one in move),
        f"{found.departure_mean / surface.size:.2%}",
        f"{found.drawn_energy:.4g}",
        f"{sum(found.energies.values()):.4g}",
        f"{found.stress_max:.0f}",
        f"{found.utilisation_max:.1f}",
        f"{found.tie_force_size.max():.3g}",
        state,
        str(found.n_steps),
        f"{seconds:.1f}",
    ]


def halved_row(weave: wc.Weave, supports: str, segments: int) -> list[str]:
    """Mean departure and stress with so many segments and with twice as many, from the supports on."""
    unit = millimetres_in(weave.lattice.latitudes.surface.unit)
    has_border = bool(weave.is_border_node.any())
    held = supports if has_border else "none"
    label = supports if has_border or supports == "none" else "no border"
    means, stresses, seconds = [], [], []
    for n in (segments, 2 * segments):
        begun = time.process_time()
        try:
            found = wc.simulate(weave, supports=held, segments=n)
        except WeaveError as error:
            return [label, str(segments), "–", "–", f"{error.code} with {n}", *["–"] * 4]
        seconds.append(f"{time.process_time() - begun:.1f}")
        means.append(found.departure_mean * unit)
        stresses.append(f"{found.stress_max:.0f}")
    change = f"{means[1] / means[0] - 1.0:+.1%}, {means[1] - means[0]:+.2g} mm"
    return [label, str(segments), f"{means[0]:.3g}", f"{means[1]:.3g}", change, *stresses, *seconds]


def replayed_row(weave: wc.Weave) -> list[str]:
    """Largest displacement of the unfinished weave in its usual sequence and in the improved one, from the rods on."""
    unit = millimetres_in(weave.lattice.latitudes.surface.unit)
    begun, seconds, moves, is_open = time.process_time(), [], [], []
    for improve in (False, True):
        found = replay(weave, improve=improve)
        seconds.append(f"{time.process_time() - begun:.0f}")
        begun = time.process_time()
        moves.append(f"{found.displacement.max() * unit:.3g}")
        is_open.append(f"{int((~found.is_converged).sum())} of {len(found)}")
    spread = ", ".join(str(g) for g in found.spread) or "none"
    return [str(len(weave)), moves[0], is_open[0], moves[1], is_open[1], spread, *seconds]


def compensated_row(weave: wc.Weave, within: float | None) -> list[str]:
    """Figures of a released weave before and after compensation; it is ended after `MOST_SECONDS`."""
    begun = time.process_time()

    def end(_signal: int, _frame: object) -> None:
        raise TimeoutError

    unit = millimetres_in(weave.lattice.latitudes.surface.unit)
    signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        limit = None if within is None else within / unit
        found = wc.compensate(weave, supports="none", within=limit)
    except TimeoutError:
        verdict = f"not decided in {MOST_SECONDS:.0f} s"
        return [*["–"] * 5, str(weave.lattice.n_nodes), verdict, *["–"] * 4, f"{time.process_time() - begun:.0f}"]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    before, after = found.before, found.after
    moves = before.departure_mean, before.departure_max, after.departure_mean, after.departure_max
    return [
        *(f"{move * unit:.3g}" for move in moves),
        str(len(found.held)),
        str(weave.lattice.n_nodes),
        found.verdict,
        f"{np.abs(found.mark_changes).max() * unit:.3g}",
        f"{before.utilisation_max:.2f}",
        f"{after.utilisation_max:.2f}",
        "yes" if after.is_stable else "no",
        f"{time.process_time() - begun:.0f}",
    ]


if __name__ == "__main__":
    main()
