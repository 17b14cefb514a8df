"""What the page holds of a table."""

from __future__ import annotations

import json
import re

from weavecore.exploring.evaluate import BEND, ENDS
from weavecore.exploring.explore_page import encode_explore_page
from weavecore.exploring.table import INPUTS, Row


def test_of_a_large_table_the_page_has_the_best_rows_in_their_order() -> None:
    inputs = dict(zip(INPUTS, ("s", "all", "1", "plain", "stock", "gfrp")))
    rows = [Row(n, inputs, {BEND: 100.0, ENDS: 5_000 - n}, "", f"k{n}", "", "", "Meters") for n in range(1, 2_003)]
    page = encode_explore_page(rows, (BEND, ENDS)).decode()
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page)
    content = json.loads(text)
    assert [row["number"] for row in content["rows"]] == list(range(3, 2_003))
    assert (content["count"], content["best"], content["unit"]) == (2_002, 2_002, "m")
