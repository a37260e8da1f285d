"""The leaderboard: its order, its committed results, and single episodes of it measured again."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks._harness import with_figures
from benchmarks.leaderboard import (
    PAGE,
    RESULTS,
    Board,
    Row,
    leaderboard_page,
    measure,
    ranked,
    read_results,
)
from benchmarks.leaderboard._page import ROBOTS, Standing
from benchmarks.leaderboard._results import (
    COLUMNS,
    PAGES,
    figures,
    over_scenarios,
    times,
)
from sim_tests import SimError
from sim_tests.scenario import Scenario
from sim_tests.study.measures import EpisodeRecord
from sim_tests.study.runs import run_episode

_BOARD = Board.read()
# Short episodes of a cheap and of a costly row.
_CELLS = [("balanced-truth", "crossing_attentive"), ("today", "crossing_attentive")]


@pytest.mark.parametrize(("name", "scenario"), _CELLS)
def test_a_committed_episode_is_measured_again_and_the_same(name, scenario):
    """After a change of planner, people or sensors: python -m benchmarks.leaderboard --again."""
    row = _BOARD.named(name)
    (was,) = (
        each for each in read_results(_BOARD, row) if (each.scenario, each.seed) == (scenario, 0)
    )
    (job,) = row.jobs([Scenario.shipped(scenario)], [0])
    now = run_episode(job)
    for field in ("robot_contacts", "person_contacts", "success", "error"):
        assert getattr(now, field) == getattr(was, field), field
    # Another kind of processor rounds differently.
    assert now.time_lost_s == pytest.approx(was.time_lost_s, abs=0.25)
    assert now.violation_time_s == pytest.approx(was.violation_time_s, abs=0.15)


def test_the_page_is_made_from_the_committed_results():
    assert PAGE.read_text(encoding="utf-8") == leaderboard_page(_BOARD)


def test_every_file_of_results_belongs_to_a_row_and_the_best_rows_are_whole():
    assert {path.stem for path in RESULTS.glob("*.csv")} <= {row.name for row in _BOARD.rows}
    planned = len(_BOARD.all_scenarios) * _BOARD.seeds
    for row in _BOARD.rows:
        assert len(read_results(_BOARD, row)) <= planned
    assert len(read_results(_BOARD, _BOARD.named(_BOARD.baseline))) == planned


def _standing(name, *, contacts=0, violation_s=0.0, lost_s=5.0, missing=0) -> Standing:
    row = Row(name=name, policy="balanced", sensors="camera")
    records = tuple(
        EpisodeRecord(
            *("a", seed, "balanced", "ReferencePlanner", "keypoints"),
            robot_contacts=int(seed < contacts),
            violation_time_s=violation_s + 0.001 * seed,
            time_lost_s=lost_s + 0.1 * seed,
        )
        for seed in range(10 - missing)
    )
    return Standing(row, records, 10)


def _times(factor=1.0, lost_s=2.0) -> Standing:
    records = tuple(
        EpisodeRecord(
            *(scenario, seed, "balanced", "ReferencePlanner", "keypoints"),
            time_to_goal_s=factor * (10.0 + number + 0.1 * seed),
            time_lost_s=lost_s + number,
        )
        for number, scenario in enumerate("abcd")
        for seed in range(3)
    )
    return Standing(Row(name="a", policy="balanced", sensors="camera"), records, 12)


def test_the_results_compare_the_same_episodes_of_two_rows():
    same = times(_times(), _times())
    assert (same.value, same.low, same.high) == pytest.approx((1.0, 1.0, 1.0))
    slower = times(_times(), _times(1.5))
    assert (slower.value, slower.low, slower.high) == pytest.approx((1.5, 1.5, 1.5))
    arrives = _times()
    stuck = (replace(each, time_to_goal_s=None, duration_s=30.0) for each in arrives.records)
    never = times(arrives, replace(arrives, records=tuple(stuck)))
    base_s = sum(each.time_to_goal_s for each in arrives.records) / len(arrives.records)
    assert never.value == pytest.approx(30.0 / base_s)
    saved = over_scenarios(_times(lost_s=2.0).ran, _times(lost_s=3.5).ran, lambda a, b: b - a)
    assert (saved.value, saved.low, saved.high) == pytest.approx((1.5, 1.5, 1.5))
    assert saved.n == 4


def test_the_figures_of_the_pages_are_those_of_the_committed_rows():
    """After other rows: python -m benchmarks.leaderboard --page."""
    parts = figures(_BOARD)
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert "<!-- figures: " in text
        assert with_figures(text, parts) == text


def test_readmes_table_has_the_robots_as_columns_and_the_price_with_aware_people():
    table = figures(_BOARD)["meetings"].split("\n\n")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    assert cells[0][1:] == list(COLUMNS)
    rows = {line[0]: [each for cell in line[1:] for each in cell.split("; ")] for line in cells[2:]}
    never, noticed, everybody = (
        [float(cell) for title, line in rows.items() for cell in line if word in title]
        for word in ("never noticed", "had noticed", "impacts, all")
    )
    assert np.add(never, noticed) == pytest.approx(everybody, abs=0.11)
    for number, name in enumerate(ROBOTS):
        records = read_results(_BOARD, _BOARD.named(name))
        lost_s = np.mean([each.time_lost_s for each in records])
        assert rows["seconds lost, all"][number] == f"{lost_s:.1f}"
    assert "nan" not in "".join(table)


def test_contacts_come_before_violation_and_violation_before_time():
    rows = [
        _standing("touches", contacts=1, lost_s=0.1),
        _standing("violates", violation_s=0.3, lost_s=1.0),
        _standing("slow", lost_s=6.0),
        _standing("fast", lost_s=4.0),
        _standing("fast-but-0.004-s-more", violation_s=0.0003, lost_s=3.9),
        _standing("unfinished", lost_s=0.0, missing=1),
    ]
    whole = _standing("failed")
    failed = (*whole.records[1:], replace(whole.records[0], error="died"))
    rows.append(replace(whole, records=failed))
    names = [each.row.name for each in ranked(rows)]
    assert names == ["fast-but-0.004-s-more", "fast", "slow", "violates", "touches"]
    assert [each.row.name for each in ranked(rows[::-1])] == names


# A robot that drives 0.6 m past a person who stands.
_SCENARIO = """
name: short
description: Two seconds.
duration_s: 2.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 0.6}
people:
  - name: stands
    route: [{x_m: {uniform: {low: 3.0, high: 4.0}}, y_m: -1.0}]
    glances: {notices_within_m: 0.0}
    social: false
"""


def _small_board(folder, **changed) -> Board:
    scenario = folder / "short.yaml"
    scenario.write_text(_SCENARIO)
    rows = [
        {"name": "today", "policy": "blind", "sensors": "truth"},
        {"name": "mine", "policy": "balanced", "sensors": "truth", **changed},
    ]
    return Board(scenarios=[str(scenario)], seeds=2, baseline="today", rows=rows)


def test_rows_that_are_missing_or_not_whole_are_measured(tmp_path):
    board = _small_board(tmp_path)
    measure(board, board.rows, tmp_path, work=tmp_path / "runs")
    whole = {path.name: path.read_bytes() for path in tmp_path.glob("*.csv")}
    assert set(whole) == {"today.csv", "mine.csv"}
    assert list((tmp_path / "runs").iterdir()) == []
    assert "Not complete" not in leaderboard_page(board, tmp_path)
    (tmp_path / "mine.csv").write_bytes(b"".join(whole["mine.csv"].splitlines(True)[:-1]))
    page = leaderboard_page(board, tmp_path)
    assert "Not complete, and so without a rank: `mine`." in " ".join(page.split())
    assert re.search(r"\| – `balanced`, truth, reference \| 0 of 1 ", page)
    measure(board, board.rows, tmp_path, work=tmp_path / "runs")
    assert {path.name: path.read_bytes() for path in tmp_path.glob("*.csv")} == whole


def test_networks_of_a_row_see_pixels_and_belong_to_it(tmp_path):
    networks = tmp_path / "real.yaml"
    networks.write_text("head: pnp")
    plain = Row(name="mine", policy="balanced", sensors="camera+scanner")
    row = plain.model_copy(update={"networks": str(networks)})
    (job,) = row.jobs([Scenario.shipped("blind_corner")], [0])
    assert (job.perception, job.networks) == ("pixels+scanner", "real")
    assert row.senses == "camera+scanner with real"
    digests = [plain.digest, row.digest]
    networks.write_text("head: network")
    assert len({*digests, row.digest}) == 3


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"sensors": "lidar"}, "sensors"),
        ({"plannner": "reference"}, "did you mean 'planner'"),
        ({"name": "today"}, "a name of its own"),
    ],
)
def test_rows_that_are_not_valid_are_refused(tmp_path, changed, message):
    with pytest.raises((SimError, ValueError), match=message):
        _small_board(tmp_path, **changed)
