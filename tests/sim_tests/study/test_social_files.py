"""Exported episodes: what is written is read again, and a broken file names its field."""

from __future__ import annotations

import copy
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from social_scenes import formula_episode, random_episode, straight

from nav_adapter import NavError, ros2
from sim_tests import SimError
from sim_tests.study.social import (
    FORMATS,
    check_episode,
    read_episode,
    social_measures,
    write_episode,
)
from sim_tests.study.social._episode import headings_of, sides, velocities

ARRAYS = (
    *("t_s", "robot_m", "robot_heading_rad", "yaw_rate_radps", "people_m"),
    *("people_heading_rad", "people_mps", "goal_m", "walls_m"),
)
LONG_HEADER = "timestamp,x,y,column,robot_x,robot_y,robot_yaw_rad\n"


def boxed(seed=2):
    """A random episode in a hall with a rack."""
    episode = random_episode(seed, count=40)
    boxes = np.array([[1.0, 1.5, 3.0, 2.5], [-6.0, -6.0, 9.0, -5.5]])
    fields = {name: getattr(episode, name) for name in type(episode).__dataclass_fields__}
    return type(episode)(**{**fields, "boxes_m": boxes, "walls_m": sides(boxes)})


@pytest.fixture(params=["socnav3", "mcap"])
def written(request, tmp_path):
    """A file that holds everything, and the episode in it."""
    if request.param == "mcap":
        pytest.importorskip("mcap", reason="the extra ros2 is not installed")
    path = tmp_path / f"episode{FORMATS[request.param].suffix}"
    write_episode(path, boxed(), request.param)
    return path


def test_an_exported_episode_is_correct_and_read_back_equal(written):
    assert check_episode(written) == []
    episode, again = boxed(), read_episode(written)
    for name in ARRAYS:
        assert np.array_equal(getattr(again, name), getattr(episode, name), equal_nan=True), name
    assert np.allclose(again.robot_mps, episode.robot_mps, atol=1e-12)
    assert (again.outcome, again.name) == (episode.outcome, episode.name)
    before, after = social_measures(episode), social_measures(again)
    for name, value in before.items():
        expected = None if value is None else pytest.approx(value, rel=1e-9, abs=1e-9)
        assert after[name] == expected, name


def test_an_mcap_file_holds_poses_that_foxglove_draws(tmp_path):
    library = pytest.importorskip("mcap.reader", reason="the extra ros2 is not installed")
    path, episode = tmp_path / "episode.mcap", boxed()
    write_episode(path, episode)
    with path.open("rb") as stream:
        messages = [
            (schema.name, channel.topic, message.log_time, json.loads(message.data))
            for schema, channel, message in library.make_reader(stream).iter_messages()
        ]
    robot = [each for each in messages if each[0] == "foxglove.PoseInFrame"]
    people = [each for each in messages if each[0] == "foxglove.PosesInFrame"]
    assert len(robot) == len(people) == len(episode.t_s)
    _, topic, log_time, last = robot[-1]
    assert topic == "/robot"
    assert log_time == pytest.approx(1e9 * (episode.t_s[-1] - episode.t_s[0]), abs=1.0)
    assert last["timestamp"] == {"sec": log_time // 10**9, "nsec": log_time % 10**9}
    assert last["pose"]["position"] == {
        "x": episode.robot_m[-1, 0],
        "y": episode.robot_m[-1, 1],
        "z": 0.0,
    }
    turn = last["pose"]["orientation"]
    yaw = 2.0 * math.atan2(turn["z"], turn["w"])
    assert math.cos(yaw - episode.robot_heading_rad[-1]) == pytest.approx(1.0)
    assert [len(each[3]["poses"]) for each in people] == episode.present.sum(axis=1).tolist()


def test_a_navwareset_track_keeps_positions_to_the_bit_and_derives_the_rest(tmp_path):
    path, episode = tmp_path / "track.csv", boxed()
    write_episode(path, episode)
    assert check_episode(path) == []
    assert path.read_text().startswith(LONG_HEADER)
    again = read_episode(path)
    assert np.array_equal(again.robot_m, episode.robot_m)
    assert np.array_equal(again.robot_heading_rad, episode.robot_heading_rad)
    assert np.array_equal(again.people_m, episode.people_m, equal_nan=True)
    assert np.allclose(again.t_s, episode.t_s - episode.t_s[0], atol=1e-9)
    before, after = social_measures(episode), social_measures(again)
    for name in before:
        if name.startswith("navwareset_") or name == "people_jerk_mps3":
            assert after[name] == pytest.approx(before[name], rel=1e-5), name
    assert after["spl"] is after["path_irregularity_rad"] is None


def test_both_layouts_of_navwareset_give_the_same_episode(tmp_path):
    """The second is that of people who stand; its fifth person is not there."""
    wide = tmp_path / "wide.csv"
    wide.write_text(
        "timestamp,robot_x,robot_y,robot_yaw_rad,x1,y1,x2,y2,x5,y5\n"
        "1730818675992630528,1.5,2.0,-0.25,0.2,1.0,0.9,1.5,,\n"
        "1730818676092630528,1.6,2.1,-0.23,0.2,1.0,0.9,1.5,nan,nan\n"
    )
    long = tmp_path / "long.csv"
    long.write_text(
        LONG_HEADER + "1730818675992630528,0.2,1.0,1,1.5,2.0,-0.25\n"
        "1730818675992630528,0.9,1.5,2,1.5,2.0,-0.25\n"
        "1730818676092630528,0.2,1.0,1,1.6,2.1,-0.23\n"
        "1730818676092630528,0.9,1.5,2,1.6,2.1,-0.23\n"
    )
    first, second = read_episode(wide), read_episode(long)
    assert first.t_s.tolist() == [0.0, pytest.approx(0.1, abs=1e-12)]
    for name in ("t_s", "robot_m", "people_m", "people_mps", "people_heading_rad"):
        assert np.array_equal(getattr(first, name), getattr(second, name)), name
    assert first.robot_mps[1] == pytest.approx([1.0, 1.0])


def test_a_track_without_people_or_without_yaw_is_read(tmp_path):
    alone = tmp_path / "alone.csv"
    write_episode(alone, formula_episode([0.0, 0.5], straight(1.0)))
    assert check_episode(alone) == []
    assert read_episode(alone).people == 0
    older = tmp_path / "older.csv"
    older.write_text(
        "timestamp,x,y,column,robot_x,robot_y\n"
        "1.7308254711311314e+18,3.13,-0.54,3,9.0,-0.4\n"
        "1.7308254712310684e+18,3.14,-0.54,3,8.9,-0.4\n"
    )
    assert check_episode(older) == []
    assert np.abs(read_episode(older).robot_heading_rad) == pytest.approx([math.pi, math.pi])


def corrupted(change):
    """The SocNav3 document of an episode, changed in one place."""
    document = copy.deepcopy(corrupted.document)
    change(document)
    return document


@pytest.fixture(scope="module", autouse=True)
def _document(tmp_path_factory):
    path = tmp_path_factory.mktemp("document") / "episode.json"
    write_episode(path, boxed())
    corrupted.document = json.loads(path.read_text())


def test_the_published_fields_are_written():
    """Names and units of the repository's schema.json; a rack is 1 in the grid, seen from above."""
    document = corrupted.document
    frame, grid = document["sequence"][0], document["grid"]
    assert set(frame) == {"timestamp", "robot", "goal", "people", "objects"}
    assert frame["robot"]["shape"] == {"type": "rectangle", "width": 0.5, "length": 0.7}
    assert frame["goal"]["type"] == "go-to"
    assert frame["goal"]["human"] is None
    assert len(document["walls"]) == 8
    assert (grid["x_orig"], grid["y_orig"], grid["cell_size"]) == (-6.0, -6.0, 0.1)
    cells = np.array(grid["data"])[::-1]  # the first row has the largest y
    assert cells.shape == (grid["height"], grid["width"])
    assert cells[int((2.0 + 6.0) / 0.1), int((2.0 + 6.0) / 0.1)] == 1
    assert cells[int((0.0 + 6.0) / 0.1), int((2.0 + 6.0) / 0.1)] == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("walls"), "walls is missing"),
        (lambda d: d["grid"].pop("cell_size"), "grid.cell_size is missing"),
        (lambda d: d["grid"]["data"][3].pop(), "grid.width is"),
        (lambda d: d["grid"]["data"].pop(), "grid.height is"),
        (lambda d: d["grid"]["data"][0].__setitem__(1, 7), "grid.data[0][1] must be one of"),
        (lambda d: d["walls"][1].pop(), "walls[1] must have 4 values, got 3"),
        (lambda d: d.update(sequence=[]), "sequence must have at least 1 values, got 0"),
        (lambda d: d["sequence"][2].pop("goal"), "sequence[2].goal is missing"),
        (
            lambda d: d["sequence"][5]["robot"].update(x="1.0"),
            "sequence[5].robot.x must be a number, got '1.0'",
        ),
        (
            lambda d: d["sequence"][5]["robot"].update(speed_a=math.nan),
            "sequence[5].robot.speed_a must be a number, got nan",
        ),
        (
            lambda d: d["sequence"][0]["robot"]["shape"].pop("length"),
            "sequence[0].robot.shape.length is missing",
        ),
        (
            lambda d: d["sequence"][0]["goal"].update(type="walk"),
            "sequence[0].goal.type must be one of 'go-to', 'guide-to', 'follow', got 'walk'",
        ),
        (lambda d: d["sequence"][1]["people"][0].pop("id"), "sequence[1].people[0].id is missing"),
        (
            lambda d: d["sequence"][1]["people"][1].update(id=0),
            "sequence[1].people has an id twice",
        ),
        (
            lambda d: d["sequence"][4].update(timestamp=0.0),
            "sequence[4].timestamp must be later than the one before",
        ),
        (lambda d: d["awarenav"].update(success=1), "awarenav.success must be true or false"),
    ],
)
def test_a_broken_trajectory_names_the_field(change, message, tmp_path):
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(corrupted(change)))
    found = check_episode(path)
    assert any(message in line for line in found), found
    with pytest.raises(SimError, match=r"broken\.json is not a SocNav3 trajectory"):
        read_episode(path)


def test_a_trajectory_of_others_needs_no_part_of_ours(tmp_path):
    """Velocities come from positions, and success from the distance to the goal at the end."""
    document = corrupted(lambda d: [d.pop("awarenav"), d.pop("metadata")])
    for frame in document["sequence"]:
        frame["robot"]["shape"] = {"type": "circle", "width": 0.6, "height": 0.6}
        for person in frame["people"]:
            del person["speed_x"], person["speed_y"]
    document["sequence"][-1]["robot"].update(x=6.0, y=1.2)
    path = tmp_path / "theirs.json"
    path.write_text(json.dumps(document))
    assert check_episode(path) == []
    episode = read_episode(path)
    assert episode.robot_radius_m == 0.3
    assert episode.outcome.success is True
    assert episode.name == "theirs"
    assert np.array_equal(episode.robot_mps[1:], velocities(episode.t_s, episode.robot_m)[1:])
    assert social_measures(episode)["spl"] is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the column timestamp is missing"),
        ("timestamp,x,y,column\n", "the column robot_x is missing"),
        (
            LONG_HEADER.replace("column", "column_id"),
            "the column 'column_id' is none of NavWareSet's",
        ),
        (LONG_HEADER, "there are no rows"),
        (LONG_HEADER + "0,1,2,1,0,0\n", "line 2 has 6 cells, the header 7"),
        (LONG_HEADER + "0,one,2,1,0,0,0\n", "line 2: x must be a number, got 'one'"),
        (LONG_HEADER + "0,inf,2,1,0,0,0\n", "line 2: x must be a number, got 'inf'"),
        (LONG_HEADER + "5,1,2,1,0,0,0\n4,1,2,1,0,0,0\n", "line 3: timestamp must not be earlier"),
        (LONG_HEADER + "5,1,2,1,0,0,0\n5,1,2,1,0,0,0\n", "line 3: column 1 is there twice"),
        (LONG_HEADER + "5,1,2,1,0,0,0\n5,1,2,2,9,0,0\n", "line 3: robot_x, robot_y differ"),
        ("timestamp,robot_x,robot_y,x1\n0,0,0,1\n", "the column x1 is there without its other"),
        ("timestamp,robot_x,robot_y,robot_x\n", "the column robot_x is there 2 times"),
    ],
)
def test_a_broken_track_names_line_and_column(text, message, tmp_path):
    path = tmp_path / "track.csv"
    path.write_text(text)
    assert any(message in line for line in check_episode(path)), check_episode(path)
    with pytest.raises(SimError, match="is not a NavWareSet track"):
        read_episode(path)


def test_files_that_are_none_are_refused(tmp_path):
    bad = tmp_path / "bad.json"
    bad.write_text("{")
    with pytest.raises(SimError, match=r"bad\.json is not valid JSON"):
        check_episode(bad)
    with pytest.raises(SimError, match=r"ends in \.json \(socnav3\), \.csv .*, got .*episode\.txt"):
        check_episode(tmp_path / "episode.txt")
    with pytest.raises(SimError, match="did you mean 'socnav3'"):
        write_episode(tmp_path / "x.json", boxed(), "socnav")
    with pytest.raises(SimError, match=r"cannot read .*none\.csv"):
        check_episode(tmp_path / "none.csv")


def test_a_recording_that_is_none_is_refused(tmp_path):
    pytest.importorskip("mcap", reason="the extra ros2 is not installed")
    path = tmp_path / "other.mcap"
    with ros2.JsonMcapRecorder(path) as recorder:
        recorder.add_topic("/frame", "socnav3.Frame", {})
        recorder.write("/frame", {}, 0.0)
    assert check_episode(path) == ["topic /episode must hold one JSON object, got 0 messages"]
    path.write_bytes(b"no recording")
    with pytest.raises(NavError, match=r"other\.mcap is not an MCAP file"):
        check_episode(path)


def test_an_episode_without_a_goal_is_no_trajectory(tmp_path):
    episode = formula_episode([0.0, 1.0], straight(1.0), goal_m=None)
    with pytest.raises(SimError, match="needs the robot's goal"):
        write_episode(tmp_path / "x.json", episode)
    assert list(tmp_path.iterdir()) == []


@settings(max_examples=25)
@given(st.lists(st.sampled_from([0.0, 1.0, math.nan]), min_size=1, max_size=8))
def test_velocities_are_known_exactly_where_positions_are(presence):
    """A body that moves at (2, −1) m/s and is absent at times."""
    t_s = np.arange(float(len(presence)))
    gone = np.isnan(presence)
    positions = np.where(gone[:, None], np.nan, np.stack([2.0 * t_s, -t_s], axis=1))
    found = velocities(t_s, positions)
    assert np.array_equal(np.isnan(found[:, 0]), gone)
    for row in np.flatnonzero(~gone):
        near = row > 0 and not gone[row - 1]
        assert not near or found[row] == pytest.approx([2.0, -1.0])


def test_a_body_that_stops_keeps_its_heading():
    velocity = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 0.01], [-1.0, 0.0]])
    quarter = math.pi / 2
    assert headings_of(velocity) == pytest.approx([quarter, quarter, quarter, math.pi])
