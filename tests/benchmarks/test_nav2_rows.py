"""The table of crossings under Nav2 is that of the committed rows."""

from __future__ import annotations

from paths import ROOT

from benchmarks.nav2._results import ROWS, table
from sim_tests.study.measures import read_records


def test_the_page_has_the_table_of_the_committed_rows() -> None:
    page = (ROOT / "docs" / "test_your_nav2.md").read_text(encoding="utf-8")
    assert table() in page


def test_the_page_says_how_late_the_cycles_of_these_rows_were() -> None:
    late = [each.late_share or 0.0 for each in read_records(ROWS)]
    text = " ".join((ROOT / "docs" / "test_your_nav2.md").read_text(encoding="utf-8").split())
    assert f"in {sum(each > 0.02 for each in late)} of {len(late)} episodes more than 2 %" in text
    assert f"at most {100 * max(late):.0f} %" in text
