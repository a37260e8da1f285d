"""The notebook of the first ten minutes runs in an empty folder and prints what it shows."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
from paths import ROOT

pytest.importorskip("pybullet", reason="the notebook runs crossings (extra sim)")
sys.path.insert(0, str(ROOT))

from tools.docs_site.notebook import NOTEBOOK, code_cells, page, printed, read, run_cells

_NUMBER = re.compile(r"\d+\.\d+")


@pytest.mark.full
def test_every_cell_runs_and_prints_what_is_stored(tmp_path: Path) -> None:
    notebook = read()
    results = run_cells(notebook, tmp_path)
    assert len(results) == 6
    for cell, outputs in zip(code_cells(notebook), results, strict=True):
        now, stored = printed(outputs), printed(cell["outputs"])
        assert _NUMBER.sub("0", now) == _NUMBER.sub("0", stored)
        pairs = zip(_NUMBER.findall(now), _NUMBER.findall(stored), strict=True)
        # Another processor may round otherwise; a shown figure must not be wrong.
        assert all(float(a) == pytest.approx(float(b), abs=0.1) for a, b in pairs)
        kinds = [sorted(each.get("data", each)) for each in outputs]
        assert kinds == [sorted(each.get("data", each)) for each in cell["outputs"]]


def test_an_aware_worker_costs_less_time_than_an_unaware_one() -> None:
    """The text below the results says so."""
    text = "\n".join(printed(cell["outputs"]) for cell in code_cells(read()))
    times = {
        words[:2]: float(words[2])
        for words in re.findall(r"^(\w+) +(\w+) +goal after +([\d.]+) s", text, re.MULTILINE)
    }
    aware, blind = times["balanced", "attentive"], times["blind", "attentive"]
    assert aware < blind - 1.0
    assert times["balanced", "distracted"] == pytest.approx(blind, abs=0.3)


def test_the_file_is_small_and_the_page_shows_code_output_and_picture() -> None:
    assert NOTEBOOK.stat().st_size < 100_000
    text, pictures = page(read(), "ten")
    assert text.startswith("# The first ten minutes\n")
    assert 'title="Output"' in text
    assert [*pictures] == ["ten_1.png"]
    assert "](ten_1.png)" in text
    assert pictures["ten_1.png"].startswith(b"\x89PNG")


def test_cells_share_a_namespace_and_the_last_expression_is_shown(tmp_path: Path) -> None:
    cells = [
        {"cell_type": "code", "source": ["import os\n", "x = 2\n", "print(os.listdir())"]},
        {"cell_type": "markdown", "source": ["text"]},
        {"cell_type": "code", "source": ["x + 3"]},
    ]
    first, second = run_cells(json.loads(json.dumps({"cells": cells})), tmp_path)
    assert printed(first) == "[]\n"
    assert printed(second) == "5"
