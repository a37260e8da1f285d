"""The film of an aisle: the camera's pictures, the lanes and their figures."""

from dataclasses import replace

import numpy as np
import pytest
from paths import ROOT

from awarenav.drawing import awareness_colour
from awarenav.errors import AwarenavError
from awarenav.figures import Image
from nav_adapter import Alert
from sim_tests import Scenario, run_crossing
from sim_tests.demo._camera_film import CAMERA_PX, PICTURE_S, CameraRecorder
from sim_tests.demo._film import (
    FILM_HZ,
    FILM_PX,
    HOLD_S,
    ComparisonRow,
    decisive_picture,
    draw_lane,
    draw_map,
    passage,
    scale_of,
    time_lost_s,
    unaware_person,
    write_crossing_film,
)

SENSES = "keypoints+scanner"


@pytest.fixture(scope="module")
def scenario():
    return Scenario.shipped("steps_out_in_aisle").with_values({})


@pytest.fixture(scope="module")
def free(scenario):
    nobody = scenario.without_people()
    result = run_crossing(nobody, policy="balanced", perception="truth")
    return ComparisonRow("nobody there", result, nobody)


@pytest.fixture(scope="module")
def aware(scenario):
    recorder = CameraRecorder()
    # The robot is nearest to the person with the phone at 9.15 s.
    short = scenario.model_copy(update={"duration_s": 10.0})
    result = run_crossing(short, policy="balanced", perception=SENSES, observer=recorder)
    return ComparisonRow("awarenav", result, scenario, recorder.pictures)


def with_frames(row, frames):
    return replace(row, result=replace(row.result, frames=tuple(frames)))


@pytest.mark.slow
def test_the_lanes_show_the_passage_of_the_person_with_the_phone(aware, free):
    person = unaware_person(aware.result)
    assert aware.scenario.people[person].name == "reader"
    near = passage(aware.result, person)
    assert near.t_s < aware.result.frames[-1].t_s - 0.5
    moving = [each for each in aware.result.frames if abs(each.robot_state.travel_mps) > 0.05]
    distances = [frame.separations_m[person] for frame in moving]
    assert near.distance_m == pytest.approx(min(distances), abs=0.05)
    # A touch while the robot moves is a distance of 0, at the speed of the touch.
    touched = passage(replace(aware.result, contacts=(Touch(person),)), person)
    assert (touched.distance_m, touched.speed_mps) == (0.0, 1.25)
    hits, passes = (
        draw_lane(
            replace(aware, result=replace(aware.result, contacts=each)), free.result, person, None
        )
        for each in ((Touch(person),), ())
    )
    assert red_letters(hits) > 200 + red_letters(passes)


class Touch:
    """A contact in which the robot moves into a person."""

    t_s, by, robot_speed_mps = 6.0, "robot", 1.25

    def __init__(self, worker):
        self.worker = worker


def red_letters(lane):
    return int((np.abs(lane[-30:].astype(int) - (255, 122, 108)).sum(axis=2) < 30).sum())


@pytest.mark.slow
def test_the_circle_on_the_map_has_the_radius_and_place_of_the_obstacle(aware):
    frames = list(aware.result.frames)
    index = next(k for k, each in enumerate(frames) if len(each.constraints.obstacles) == 2)
    obstacles = frames[index].constraints.obstacles
    reader = max(obstacles, key=lambda each: each.center_odom_m[0])
    others = tuple(each for each in obstacles if each is not reader)
    less = list(frames)
    less[index] = replace(
        frames[index], constraints=replace(frames[index].constraints, obstacles=others)
    )
    t_s = frames[index].t_s
    change = draw_map(aware, t_s).astype(int) - draw_map(with_frames(aware, less), t_s)
    _, columns = np.nonzero(np.abs(change).sum(axis=2) > 40)
    scale = scale_of(aware)
    u, _ = scale.px(reader.center_odom_m[None])[0]
    # The line is 3 px wide.
    assert 0.5 * np.ptp(columns) / scale.px_per_m == pytest.approx(reader.radius_m, abs=0.1)
    assert 0.5 * (columns.min() + columns.max()) == pytest.approx(u, abs=2.0)


@pytest.mark.slow
def test_the_map_shows_a_request_for_two_seconds(aware):
    frames = [
        replace(each, constraints=replace(each.constraints, alerts=(), answers=()))
        for each in aware.result.frames
    ]
    silent = with_frames(aware, frames)
    track, *_ = frames[60].tracks
    request = Alert(track.id, "attention", 0.0, 1.0, "why", means="light", wins_s=1.4)
    frames[60] = replace(frames[60], constraints=replace(frames[60].constraints, alerts=(request,)))
    asks = with_frames(aware, frames)
    for t_s, shown in ((-0.05, False), (0.0, True), (1.9, True), (2.1, False)):
        maps = [draw_map(each, frames[60].t_s + t_s) for each in (asks, silent)]
        assert bool((maps[0] != maps[1]).any()) is shown


@pytest.mark.slow
def test_the_first_picture_has_both_people_with_their_colours(aware):
    pictures = aware.pictures
    assert len(pictures) == int(aware.result.frames[-1].t_s / PICTURE_S + 1e-6) + 1
    assert pictures[0].rgb.shape == (CAMERA_PX[1], CAMERA_PX[0], 3)
    shown = decisive_picture(aware)
    assert shown.whole == {0, 1}
    red, green, _ = np.moveaxis(shown.rgb[60:340].astype(int), 2, 0)
    # The bars and corners of the labels; the hall has no such green.
    assert ((green > 150) & (red < 110)).sum() > 100
    assert (np.abs(shown.rgb.astype(int) - awareness_colour(0.0)).sum(axis=2) < 40).sum() > 100


@pytest.mark.slow
def test_the_film_begins_with_the_results_and_shows_every_picture(aware, free, tmp_path):
    short = with_frames(aware, aware.result.frames[:41])
    rows = [
        free,
        *(replace(short, label=each) for each in ("today-costmap", "blind")),
        short,
    ]
    paths = [tmp_path / "film.webp", tmp_path / "film.mp4"]
    write_crossing_film(paths, rows)
    with Image.open(paths[0]) as film:
        assert film.size == FILM_PX
        assert film.info["loop"] == 0
        assert film.n_frames == 12
        film.load()
        assert film.info["duration"] == pytest.approx(1000 * HOLD_S, rel=0.1)
    assert paths[1].stat().st_size > 10_000
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(AwarenavError, match=r"\.webp or \.mp4 file, got .*film\.avi"):
        write_crossing_film([tmp_path / "film.avi"], rows)


@pytest.mark.slow
def test_time_is_lost_against_the_crossing_with_nobody_there(aware, free):
    arrived = replace(aware.result, time_to_goal_s=14.9)
    assert time_lost_s(arrived, free.result) == pytest.approx(14.9 - free.result.time_to_goal_s)
    assert time_lost_s(aware.result, free.result) is None


def test_the_film_in_the_documentation_is_whole_and_fits_a_readme():
    path = ROOT / "docs" / "images" / "crossing.webp"
    assert 100_000 < path.stat().st_size <= 1_500_000
    with Image.open(path) as film:
        assert film.size == FILM_PX
        # The slowest of the three robots takes more than 12 s, at twice the speed.
        assert film.n_frames > 12.0 / PICTURE_S
        first = np.asarray(film.convert("RGB")).astype(int)
    # The first picture has the camera's picture at the left: many colours, no empty plate.
    assert first[60:400, 20:350].std(axis=(0, 1)).min() > 25.0
    assert FILM_HZ * PICTURE_S == 2.0
