"""Folders of fabricated samples, in memory."""

from __future__ import annotations

from functools import cache

from weavecore.fabricating.csv_tables import ReadTable, Source, read_table
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import Fabrication, fabricate_weave
from weavecore.model import Weave
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_sample

SHELL = "shell_2400x1600"
PATTERNS = ("triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal")
SAMPLES = (SHELL, "hemisphere", "narrow_neck", "six_way_joint", "minimal_surface")
TABLES_ONLY = Workshop(templates=())


def make(weave: Weave, workshop: Workshop = TABLES_ONLY) -> Fabrication:
    source = Source("1.2.3", "0" * 64, weave.over_under, weave.lattice.pattern)
    return fabricate_weave(weave, find_sequence(weave), scale=1.0, workshop=workshop, source=source)


@cache
def made(name: str, pattern: str = "triangular", workshop: Workshop = TABLES_ONLY) -> Fabrication:
    return make(woven_sample(name, pattern), workshop)


def table(folder: Fabrication, name: str) -> ReadTable:
    return read_table(folder.files[f"{name}.csv"])
