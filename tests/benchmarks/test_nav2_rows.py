"""The table of crossings under Nav2 is that of the committed rows."""

from __future__ import annotations

from paths import ROOT

from benchmarks.nav2._results import ON_ITS_CURVE, ROWS, table
from sim_tests.actors.robot import RobotModel
from sim_tests.study.measures import read_records


def test_the_page_has_the_table_of_the_committed_rows() -> None:
    page = (ROOT / "docs" / "test_your_nav2.md").read_text(encoding="utf-8")
    assert table() in page


def test_the_page_says_how_late_the_cycles_of_these_rows_were() -> None:
    late = [each.late_share or 0.0 for each in read_records(ROWS)]
    text = " ".join((ROOT / "docs" / "test_your_nav2.md").read_text(encoding="utf-8").split())
    assert f"in {sum(each > 0.02 for each in late)} of {len(late)} episodes more than 2 %" in text
    assert f"at most {100 * max(late):.0f} %" in text


def test_the_robot_on_its_curve_is_that_of_the_other_rows() -> None:
    own = RobotModel.from_yaml(ON_ITS_CURVE).model_dump()
    same = {**RobotModel.shipped("nova_carter").model_dump(), "brakes_on_curve": True}
    assert {key: own[key] for key in own if key not in ("name", "description")} == {
        key: same[key] for key in same if key not in ("name", "description")
    }
