"""The film of a crossing, its panels, and the time lost in its headline."""

from dataclasses import replace

import numpy as np
import pytest
from paths import ROOT

from awarenav.errors import AwarenavError
from awarenav.figures import Image
from nav_adapter import Alert
from sim_tests import Scenario, run_crossing
from sim_tests.demo._comparison import (
    FILM_HZ,
    PORTRAIT_PX,
    ComparisonRow,
    PortraitRecorder,
    headline,
    plot_comparison,
    time_behind_s,
    time_lost_s,
)
from sim_tests.demo._film import (
    HOLD_S,
    MAP_PX_PER_M,
    draw_map,
    film_size_px,
    map_px,
    write_crossing_film,
)
from sim_tests.study.measures import measure, write_records


def crossed(label, scenario, **more):
    recorder = PortraitRecorder(scenario)
    result = run_crossing(scenario, observer=recorder, **more)
    return ComparisonRow(label, result, scenario, recorder.portraits)


@pytest.fixture(scope="module")
def free():
    scenario = Scenario.shipped("crossing_attentive").without_people()
    return crossed("nobody there", scenario, policy="balanced", perception="truth")


@pytest.fixture(scope="module")
def row():
    scenario = Scenario.shipped("crossing_attentive")
    senses = "keypoints+scanner"
    return crossed("aware, attentive worker", scenario, policy="balanced", perception=senses)


def with_frames(row, frames):
    return replace(row, result=replace(row.result, frames=tuple(frames)))


def test_time_lost_grows_to_the_difference_of_the_times_to_the_goal(free):
    scenario = Scenario.shipped("crossing_attentive")
    blind = run_crossing(scenario, policy="blind", perception="truth")
    lost = [time_behind_s(frame, free.result) for frame in blind.frames]
    assert lost[0] == pytest.approx(0.0, abs=0.051)  # one control cycle
    assert lost[-1] == pytest.approx(time_lost_s(blind, free.result), abs=0.2)
    assert lost[-1] > 1.0
    assert np.diff(lost).min() > -0.1
    assert time_behind_s(free.result.frames[100], free.result) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("t_s", [1.6, 4.0])
def test_the_circle_on_the_map_has_the_radius_and_place_of_the_obstacle(row, free, t_s):
    frames = list(row.result.frames)
    frame = frames[round(t_s * 20)]
    (obstacle,) = frame.constraints.obstacles
    without = replace(frame, constraints=replace(frame.constraints, obstacles=()))
    frames[round(t_s * 20)] = without
    bare = draw_map(with_frames(row, frames), free.result, t_s)
    change = draw_map(row, free.result, t_s).astype(int) - bare
    rows, columns = np.nonzero(np.abs(change).sum(axis=2) > 40)
    u, v = map_px(obstacle.center_odom_m[None])[0]
    # A pixel is 0.03 m, and the line 2 px wide.
    assert 0.5 * np.ptp(columns) / MAP_PX_PER_M == pytest.approx(obstacle.radius_m, abs=0.08)
    assert 0.5 * np.ptp(rows) / MAP_PX_PER_M == pytest.approx(obstacle.radius_m, abs=0.08)
    assert 0.5 * (columns.min() + columns.max()) == pytest.approx(u, abs=1.5)
    assert 0.5 * (rows.min() + rows.max()) == pytest.approx(v, abs=1.5)


def test_the_map_shows_a_request_for_two_seconds(row, free):
    frames = [
        replace(each, constraints=replace(each.constraints, alerts=(), answers=()))
        for each in row.result.frames
    ]
    silent = with_frames(row, frames)
    (track,) = frames[60].tracks
    request = Alert(track.id, "attention", 0.0, 1.0, "why", means="light", wins_s=1.4)
    frames[60] = replace(frames[60], constraints=replace(frames[60].constraints, alerts=(request,)))
    asks = with_frames(row, frames)
    for t_s, shown in ((-0.05, False), (0.0, True), (1.9, True), (2.1, False)):
        maps = [draw_map(each, free.result, frames[60].t_s + t_s) for each in (asks, silent)]
        assert bool((maps[0] != maps[1]).any()) is shown


def test_portraits_show_the_worker_from_behind_the_rack_to_the_edge_of_the_view(row):
    # Every second control cycle, from the first.
    assert len(row.portraits) == (len(row.result.frames) + 1) // 2
    shown = [portrait is not None for portrait in row.portraits]
    assert not shown[0]
    assert all(shown[10:50])
    assert not any(shown[65:])
    for portrait in row.portraits[10:50]:
        assert portrait.shape == (PORTRAIT_PX[1], PORTRAIT_PX[0], 3)
        assert portrait.std() > 10.0


def test_the_film_has_a_picture_for_every_tenth_of_a_second_and_holds_the_last(row, free, tmp_path):
    rows = [with_frames(row, row.result.frames[:cycles]) for cycles in (20, 41)]
    paths = [tmp_path / "film.webp", tmp_path / "film.mp4"]
    # Of the comparison, the film leaves out the blind robot.
    write_crossing_film(paths, [free, replace(row, label="awareness-blind"), *rows])
    with Image.open(paths[0]) as film:
        assert film.size == film_size_px(2)
        assert film.info["loop"] == 0
        assert film.n_frames == 21
        film.seek(film.n_frames - 1)
        film.load()
        assert film.info["duration"] == pytest.approx(1000 * HOLD_S, rel=0.1)
    assert paths[1].stat().st_size > 10_000
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(AwarenavError, match=r"\.webp or \.mp4 file, got .*film\.avi"):
        write_crossing_film([tmp_path / "film.avi"], [free, *rows])


def test_the_film_in_the_documentation_is_whole_and_fits_a_readme():
    path = ROOT / "docs" / "images" / "crossing.webp"
    assert 100_000 < path.stat().st_size <= 4_000_000
    with Image.open(path) as film:
        assert film.size == film_size_px(3)
        # The longest of the three crossings takes 14.65 s.
        assert film.n_frames > 14.6 * FILM_HZ


def test_the_headline_gives_the_time_that_each_worker_costs(row, free, tmp_path):
    late = replace(row, label="aware, distracted worker")
    costs_s = time_lost_s(row.result, free.result)
    assert f"loses {costs_s:.1f} s to a worker\nwho watches it" in headline([free, row, late])
    late = replace(late, result=replace(late.result, time_to_goal_s=None))
    assert "does not reach" in headline([free, row, late])
    plot_comparison(tmp_path / "crossings.png", [free, row, late])
    assert (tmp_path / "crossings.png").stat().st_size > 10_000


def test_a_table_of_episodes_has_no_infinities(free, tmp_path):
    write_records(tmp_path / "episodes.csv", [measure(free.result)])
    header, line = (tmp_path / "episodes.csv").read_text().splitlines()
    assert np.isinf(free.result.min_separation_m)
    assert "inf" not in line
    assert line.count(",") == header.count(",")
