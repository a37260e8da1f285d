"""Exported episodes: what is written is read again, and a broken file names what is wrong."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from social_scenes import random_episode, straight_episode

from sim_tests import SimError
from sim_tests.study.social import read_track, social_measures, write_episode
from sim_tests.study.social._episode import sides

HEADER = "timestamp,x,y,column,robot_x,robot_y,robot_yaw_rad\n"


def boxed(seed=2):
    """A random episode in a hall with a rack."""
    episode = random_episode(seed, count=40)
    boxes = np.array([[1.0, 1.5, 3.0, 2.5], [-6.0, -6.0, 9.0, -5.5]])
    fields = {name: getattr(episode, name) for name in type(episode).__dataclass_fields__}
    return type(episode)(**{**fields, "boxes_m": boxes, "walls_m": sides(boxes)})


def test_a_trajectory_has_the_fields_of_the_published_layout(tmp_path):
    path, episode = tmp_path / "episode.json", boxed()
    write_episode(path, episode)
    document = json.loads(path.read_text("utf-8"))
    assert {"metadata", "grid", "walls", "sequence"} < set(document)
    assert document["walls"] == episode.walls_m.tolist()
    assert document["awarenav"]["time_to_goal_s"] == episode.time_to_goal_s
    frames = document["sequence"]
    assert [frame["timestamp"] for frame in frames] == episode.t_s.tolist()
    for row, frame in enumerate(frames):
        robot = frame["robot"]
        assert [robot["x"], robot["y"]] == episode.robot_m[row].tolist()
        forward, left = robot["speed_x"], robot["speed_y"]
        cos, sin = math.cos(robot["angle"]), math.sin(robot["angle"])
        back = [cos * forward - sin * left, sin * forward + cos * left]
        assert back == pytest.approx(episode.robot_mps[row], abs=1e-12)
        assert robot["shape"] == {"type": "rectangle", "width": 0.5, "length": 0.7}
        assert frame["goal"]["type"] == "go-to"
        there = np.flatnonzero(episode.present[row]).tolist()
        assert [person["id"] for person in frame["people"]] == there
        for person in frame["people"]:
            assert [person["x"], person["y"]] == episode.people_m[row, person["id"]].tolist()


def test_a_track_is_read_back_equal(tmp_path):
    path, episode = tmp_path / "track.csv", random_episode(4, count=60)
    write_episode(path, episode)
    again = read_track(path)
    assert again.t_s == pytest.approx(episode.t_s - episode.t_s[0], abs=2e-9)
    assert np.array_equal(again.people_m, episode.people_m, equal_nan=True)
    assert np.array_equal(again.robot_heading_rad, episode.robot_heading_rad)
    # Velocities are differences of positions, and known exactly where these are.
    assert np.array_equal(np.isfinite(again.people_mps[..., 0]), episode.present)
    steps_s = np.diff(again.t_s)[:, None, None]
    known = np.isfinite(again.people_mps[1:]) & np.isfinite(again.people_m[:-1])
    moved_mps = np.diff(again.people_m, axis=0) / steps_s
    assert again.people_mps[1:][known] == pytest.approx(moved_mps[known])
    before, after = social_measures(episode), social_measures(again)
    for name in ("navwareset_path_length_m", "navwareset_min_distance_m", "navwareset_jerk_mps3"):
        assert after[name] == pytest.approx(before[name], rel=1e-4)
    assert after["spl"] is None


def test_a_track_without_people_and_the_second_layout_are_read(tmp_path):
    alone = straight_episode(np.arange(0.0, 2.0, 0.1))
    write_episode(tmp_path / "alone.csv", alone)
    assert read_track(tmp_path / "alone.csv").people == 0
    wide = "timestamp,robot_x,robot_y,x1,y1,x2,y2\n0,0,0,1,2,,\n1000000000,1,0,1,3,5,5\n"
    (tmp_path / "wide.csv").write_text(wide)
    episode = read_track(tmp_path / "wide.csv")
    assert episode.people_m[1].tolist() == [[1.0, 3.0], [5.0, 5.0]]
    assert np.isnan(episode.people_m[0, 1]).all()
    assert episode.robot_mps.tolist() == [[1.0, 0.0], [1.0, 0.0]]
    assert episode.robot_heading_rad.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "No columns"),
        ("x,y\n1,2\n", "the column timestamp is missing"),
        ("timestamp,x,y,column\n0,1,2,1\n", "the column robot_x is missing"),
        (HEADER, "there must be rows"),
        (HEADER + "0,one,2,1,0,0,0\n", "one"),
        (HEADER + "5,1,2,1,0,0,0\n5,1,2,1,0,0,0\n", "duplicate"),
    ],
)
def test_a_broken_track_is_refused(text, message, tmp_path):
    path = tmp_path / "track.csv"
    path.write_text(text)
    with pytest.raises(SimError, match=rf"track\.csv is not a NavWareSet track: .*({message})"):
        read_track(path)


def test_what_cannot_be_written_or_read_is_refused(tmp_path):
    with pytest.raises(SimError, match=r"ends in \.json \(socnav3\), \.csv .*, got .*episode\.txt"):
        write_episode(tmp_path / "episode.txt", boxed())
    with pytest.raises(SimError, match="did you mean 'socnav3'"):
        write_episode(tmp_path / "x.json", boxed(), "socnav")
    with pytest.raises(SimError, match=r"cannot read .*none\.csv"):
        read_track(tmp_path / "none.csv")
    aimless = straight_episode([0.0, 1.0], goal_m=None)
    with pytest.raises(SimError, match="needs the robot's goal"):
        write_episode(tmp_path / "x.json", aimless)
    assert list(tmp_path.iterdir()) == []
