"""The four robots of ``awarenav demo``: the reported rows, the shown seed, table and command."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from awarenav.cli import main
from sim_tests.demo import _demo, _lanes
from sim_tests.demo._film import unaware_person
from sim_tests.demo._lanes import (
    LANES,
    REPORTED,
    LaneRow,
    lanes_table,
    legend,
    read_report,
    report_text,
    reported_text,
    run_lane,
    shown_seed,
)
from sim_tests.scenario import Scenario

ROW = LaneRow(0, "awarenav", 12.0, 2.0, None, False, 0.80, 0.10, 0.90, 1.40, None, None)


def of_seeds(lost_s: list[float]) -> list[LaneRow]:
    other = replace(ROW, lane="blind", time_lost_s=0.0)
    return [
        replace(row, seed=seed, time_lost_s=value)
        for seed, value in enumerate(lost_s)
        for row in (ROW, replace(other, time_lost_s=-value))
    ]


def test_the_report_holds_every_robot_with_every_seed_of_this_version_of_the_scenario() -> None:
    about, rows = read_report()
    assert about["scenario"] == Scenario.shipped(_lanes.SCENARIO).id
    assert [(row.seed, row.lane) for row in rows] == [
        (seed, lane.name) for seed in range(REPORTED) for lane in LANES
    ]
    assert report_text(rows).splitlines()[1:] == _lanes._REPORT.read_text("utf-8").splitlines()[1:]


@pytest.mark.parametrize(
    ("lost_s", "seed"),
    [([5.0], 0), ([9.0, 1.0, 5.0], 2), ([9.0, 5.0, 1.0, 6.0], 1), ([3.0, 3.0, 3.0, 3.0], 1)],
)
def test_the_median_seed_by_the_time_that_awarenav_loses_is_shown(lost_s, seed) -> None:
    assert shown_seed(of_seeds(lost_s)) == seed


def test_a_near_miss_is_close_fast_and_no_touch() -> None:
    near = replace(ROW, nearest_m=0.44, nearest_mps=0.26)
    assert near.near_miss
    assert not replace(near, nearest_m=0.46).near_miss
    assert not replace(near, nearest_mps=0.24).near_miss
    assert not replace(near, touch_mps=0.5).near_miss


def test_the_table_fits_80_columns_and_shows_medians_and_counts() -> None:
    today = replace(ROW, lane="today", nearest_m=0.1, nearest_mps=1.5)
    late = replace(ROW, seed=1, time_to_goal_s=None, time_lost_s=40.0, watcher_mps=None)
    hit = replace(today, seed=1, nearest_m=0.0, touch_mps=1.234, hit=True)
    rows = [today, hit, ROW, late]
    table = lanes_table(rows)
    assert max(map(len, (table + "\n" + legend(2)).splitlines())) <= 80
    *_, of_today, of_awarenav = table.splitlines()
    assert of_today.removeprefix("today's AMR, predicts").split() == [
        *("12.0", "2.0", "1", "(1),", "1.23", "1", "0.05", "1.50", "0.90", "1.40")
    ]
    # One that never arrives or never comes near has no number.
    assert of_awarenav.removeprefix("awarenav").split() == [
        *("–", "21.0", "–", "0", "0.80", "0.10", "0.90", "–")
    ]
    assert lanes_table([late]).splitlines()[-1].split()[1:4] == ["–", "40.0", "–"]


def test_the_table_ends_with_impacts_never_noticed_and_of_all_people() -> None:
    rows = [replace(ROW, seed=seed, step_out_never=1.0, step_out_all=3.0 + seed) for seed in (0, 1)]
    assert lanes_table(rows).splitlines()[-1].split() == ["awarenav", "1.0;", "3.5"]
    assert "impacts" not in lanes_table([*rows, ROW])


@pytest.mark.slow
@pytest.mark.parametrize(
    "driven",
    [
        pytest.param(LANES[-1:], id="awarenav"),
        pytest.param(LANES, id="all", marks=pytest.mark.full),
    ],
)
def test_the_command_measures_the_reported_row_again_and_says_which_file_to_open(
    driven, tmp_path, capsys, monkeypatch
) -> None:
    """Robots that are not driven have their reported rows."""
    _, reported = read_report()
    runs = []

    def run(lane, seed, observer=None):
        if lane in driven:
            runs.append(run_lane(lane, seed, observer))
            return runs[-1]
        (row,) = (row for row in reported if (row.seed, row.lane) == (seed, lane.name))
        return SimpleNamespace(lane=lane, row=row)

    monkeypatch.setattr(_demo, "run_lane", run)
    out = tmp_path / "demo"
    assert main(["demo", "--no-video", "--json", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    tables = json.loads(printed.out)
    assert [row["lane"] for row in tables["shown"]] == [lane.name for lane in LANES]
    assert {row["seed"] for row in tables["shown"]} == {tables["seed"]} == {shown_seed(reported)}
    assert len(tables["reported"]) == REPORTED * len(LANES)
    assert tables["shown"][-1] in tables["reported"]
    assert runs[-1].scenario.people[unaware_person(runs[-1].result)].activity == "phone"
    assert len((out / "lanes.jsonl").read_text().splitlines()) == 1 + len(LANES)
    assert printed.err.splitlines()[-1] == f"Open {out / 'lanes.jsonl'}"
    assert max(map(len, printed.err.splitlines()[:-1])) <= 80


def test_the_text_of_the_reported_seeds_counts_what_their_rows_say() -> None:
    _, rows = read_report()
    text = reported_text()
    assert f"seed {shown_seed(rows)};" in text
    for lane in LANES:
        own = [row for row in rows if row.lane == lane.name]
        touched = sum(row.touch_mps is not None for row in own)
        assert f"{lane.words} in {touched}" in text
