"""The film of a crossing: its size and pictures, and the numbers and circles of its panels."""

from dataclasses import replace

import numpy as np
import pytest
from paths import ROOT

from awarenav.errors import AwarenavError
from awarenav.figures import Image
from nav_adapter import Alert
from sim_tests import Scenario, run_crossing
from sim_tests.demo import FilmRun, film_runs, film_values, write_crossing_film
from sim_tests.demo._demo import ComparisonRow
from sim_tests.demo._film import FILM_HZ, HOLD_S, PortraitRecorder, film_pictures, film_size_px
from sim_tests.demo._film_panel import MAP_PX_PER_M, PORTRAIT_PX, draw_map, map_px

MAX_BYTES = 4_000_000
SENSES = "keypoints+scanner"


@pytest.fixture(scope="module")
def free():
    scenario = Scenario.shipped("crossing_attentive").without_people()
    return run_crossing(scenario, policy="balanced", perception="truth")


@pytest.fixture(scope="module")
def scenario():
    return Scenario.shipped("crossing_attentive")


@pytest.fixture(scope="module")
def run(scenario):
    recorder = PortraitRecorder(scenario)
    result = run_crossing(scenario, policy="balanced", perception=SENSES, observer=recorder)
    boxes = scenario.layout.obstacle_boxes_odom
    return FilmRun("Aware robot", "", (0, 90, 0), result, boxes, recorder.portraits)


def shortened(run, cycles):
    return replace(run, result=replace(run.result, frames=run.result.frames[:cycles]))


def test_the_numbers_shown_are_those_of_the_frames(run, free):
    shown_people = 0
    for frame in run.result.frames[:-1]:
        values = film_values(run.result, free, frame.t_s)
        obstacles = frame.constraints.obstacles
        assert values.t_s == frame.t_s
        assert values.speed_mps == frame.robot_state.speed_mps
        assert values.speed_limit_mps == frame.constraints.speed_limit_mps
        assert frame.constraints.limited_by.endswith(values.limited_by)
        if obstacles:
            assert values.alpha == min(each.awareness_lower for each in obstacles)
            assert values.radius_m == max(each.radius_m for each in obstacles)
            shown_people += 1
        else:
            assert values.alpha is values.radius_m is None
    assert shown_people > 100


def test_a_policy_that_ignores_awareness_shows_no_alpha(run, free):
    blind = replace(run.result, policy="blind")
    assert all(film_values(blind, free, frame.t_s).alpha is None for frame in blind.frames)
    assert film_values(blind, free, 3.0).radius_m == film_values(run.result, free, 3.0).radius_m


def test_time_lost_grows_to_the_difference_of_the_times_to_the_goal(scenario, free):
    blind = run_crossing(scenario, policy="blind", perception="truth")
    lost = [film_values(blind, free, frame.t_s).lost_s for frame in blind.frames]
    assert lost[0] == pytest.approx(0.0, abs=0.051)  # one control cycle
    assert lost[-1] == pytest.approx(blind.time_to_goal_s - free.time_to_goal_s)
    assert lost[-1] > 1.0
    assert np.diff(lost).min() > -0.1
    assert film_values(free, free, 5.0).lost_s == pytest.approx(0.0, abs=1e-9)


def test_a_panel_stands_still_after_its_end(run, free):
    end_s = run.result.frames[-1].t_s
    last = film_values(run.result, free, end_s)
    assert last.finished
    assert film_values(run.result, free, end_s + 3.0) == last
    assert not film_values(run.result, free, end_s - 0.1).finished


@pytest.mark.parametrize("t_s", [1.0, 2.0, 4.0, 6.0])
def test_the_circle_on_the_map_has_the_radius_and_place_of_the_obstacle(run, free, t_s):
    frame = run.result.frames[round(t_s * 20)]
    (obstacle,) = frame.constraints.obstacles
    without = replace(frame, constraints=replace(frame.constraints, obstacles=()))
    frames = list(run.result.frames)
    frames[round(t_s * 20)] = without
    bare = replace(run, result=replace(run.result, frames=tuple(frames)))
    change = draw_map(run, free, t_s).astype(int) - draw_map(bare, free, t_s)
    rows, columns = np.nonzero(np.abs(change).sum(axis=2) > 40)
    u, v = map_px(obstacle.center_odom_m[None])[0]
    # A pixel is 0.03 m, and the line 2 px wide.
    assert 0.5 * np.ptp(columns) / MAP_PX_PER_M == pytest.approx(obstacle.radius_m, abs=0.08)
    assert 0.5 * np.ptp(rows) / MAP_PX_PER_M == pytest.approx(obstacle.radius_m, abs=0.08)
    assert 0.5 * (columns.min() + columns.max()) == pytest.approx(u, abs=1.5)
    assert 0.5 * (rows.min() + rows.max()) == pytest.approx(v, abs=1.5)


def test_the_map_shows_a_request_for_two_seconds(run, free):
    frames = [
        replace(each, constraints=replace(each.constraints, alerts=(), answers=()))
        for each in run.result.frames
    ]
    silent = replace(run, result=replace(run.result, frames=tuple(frames)))
    (track,) = frames[60].tracks
    request = Alert(track.id, "attention", 0.0, 1.0, "why", means="light", wins_s=1.4)
    limit = replace(frames[60].constraints, alerts=(request,))
    frames[60] = replace(frames[60], constraints=limit)
    asks = replace(run, result=replace(run.result, frames=tuple(frames)))
    asked_s = frames[60].t_s
    for t_s, shown in ((-0.05, False), (0.0, True), (1.9, True), (2.1, False)):
        maps = [draw_map(each, free, asked_s + t_s) for each in (asks, silent)]
        assert bool((maps[0] != maps[1]).any()) is shown


def test_the_robots_way_points_up_and_its_left_is_left():
    start, ahead, left = map_px(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    assert (ahead - start).tolist() == pytest.approx([0.0, -MAP_PX_PER_M])
    assert (left - start).tolist() == pytest.approx([-MAP_PX_PER_M, 0.0])


def test_portraits_show_the_worker_from_behind_the_rack_to_the_edge_of_the_view(run):
    assert len(run.portraits) == (len(run.result.frames) + 1) // 2  # every second, from the first
    shown = [portrait is not None for portrait in run.portraits]
    assert not shown[0]
    assert all(shown[10:50])
    assert not any(shown[65:])
    for portrait in run.portraits[10:50]:
        assert portrait.shape == (PORTRAIT_PX[1], PORTRAIT_PX[0], 3)
        assert portrait.std() > 10.0


def test_the_film_has_a_picture_for_every_tenth_of_a_second_and_holds_the_last(run, free, tmp_path):
    runs = [shortened(run, 20), shortened(run, 41)]
    write_crossing_film([tmp_path / "film.webp", tmp_path / "film.mp4"], runs, free)
    assert len(list(film_pictures(runs, free))) == 21
    with Image.open(tmp_path / "film.webp") as film:
        assert film.is_animated
        assert film.size == film_size_px(2)
        assert film.info["loop"] == 0
        assert film.n_frames == 21
        shown_ms = []
        for number in range(film.n_frames):
            film.seek(number)
            film.load()
            shown_ms.append(film.info["duration"])
    assert shown_ms[:-1] == [1000 / FILM_HZ] * 20
    assert shown_ms[-1] == pytest.approx(1000 * HOLD_S, rel=0.1)
    assert (tmp_path / "film.mp4").stat().st_size > 10_000
    assert not list(tmp_path.glob("*.part"))


def test_another_kind_of_film_is_refused(run, free, tmp_path):
    with pytest.raises(AwarenavError, match=r"\.webp or \.mp4 file, got .*film\.avi"):
        write_crossing_film([tmp_path / "film.avi"], [run], free)


# The test of the film in the documentation, below, is the shorter one of the same.
@pytest.mark.full
def test_the_film_of_whole_crossings_fits_a_readme(run, free, tmp_path):
    write_crossing_film([tmp_path / "film.webp"], [run, run, run], free)
    assert 100_000 < (tmp_path / "film.webp").stat().st_size <= MAX_BYTES


def test_the_film_in_the_documentation_is_whole_and_fits_a_readme():
    path = ROOT / "docs" / "images" / "crossing.webp"
    assert 100_000 < path.stat().st_size <= MAX_BYTES
    with Image.open(path) as film:
        assert film.size == film_size_px(3)
        # The longest of the three crossings takes 14.65 s.
        assert film.n_frames > 14.6 * FILM_HZ


def test_the_film_shows_todays_robot_and_the_aware_one_with_both_workers(run, free, scenario):
    labels = {
        "nobody there": free,
        "today's AMR": replace(run.result, policy="scanner"),
        "awareness-blind": replace(run.result, policy="blind"),
        "aware, attentive worker": run.result,
        "aware, distracted worker": replace(run.result, scenario="crossing_distracted"),
    }
    rows = tuple(ComparisonRow(label, each, scenario) for label, each in labels.items())
    shown = [(each.result.policy, each.result.scenario) for each in film_runs(rows)]
    assert shown == [
        ("scanner", "crossing_attentive"),
        ("balanced", "crossing_attentive"),
        ("balanced", "crossing_distracted"),
    ]
