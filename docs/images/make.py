"""Draw the pictures of the documents: ``python docs/images/make.py``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import weavecore as wc

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parents[1] / "sample_files"


def main() -> None:
    """Weave each sample and draw it."""
    _draw_rods("woven_dome", wc.offset(_sample("hemisphere"), spacing=75.0))
    _draw("six_way_joint", wc.offset(_sample("six_way_joint"), spacing=30.0))
    _draw("from_one_border", wc.offset(_sample("minimal_surface"), spacing=30.0, borders=[0]))
    _draw("from_a_curve", wc.offset(_sample("hemisphere"), spacing=30.0, curves=[_wave(300.0)]))


def _sample(name: str) -> wc.SurfaceMesh:
    return wc.read_surface(SAMPLES / f"{name}.3dm")


def _wave(radius: float) -> np.ndarray:
    """A curve over a hemisphere about the origin, from one point inside to another."""
    x = np.linspace(-0.65, 0.5, 60) * radius
    y = 0.2 * radius * np.sin(x / (0.2 * radius))
    return np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2)], axis=1)


def _draw(name: str, latitudes: wc.Latitudes) -> None:
    wc.draw_picture(wc.link(latitudes), HERE / f"{name}.png", size=(1000, 750), overwrite=True)


def _draw_rods(name: str, latitudes: wc.Latitudes) -> None:
    woven = wc.weave(wc.link(latitudes, pattern="kagome"), material="rattan")
    wc.draw_picture(woven, HERE / f"{name}.png", size=(1000, 750), overwrite=True)


if __name__ == "__main__":
    main()
