"""Perception of the robot of a crossing, by the name of its perception."""

from __future__ import annotations

import numpy as np
import pytest
from watching_cameras import setup_on

from perception import AttentionCone
from sim_tests import Scenario, SimError, run_crossing
from sim_tests.conditions import CAMERAS, Perception
from sim_tests.crossing import Stage
from sim_tests.crossing.sensors import MapView, World, sensor_class

NAMES = (*CAMERAS, "scanner", "keypoints+scanner", "pixels+scanner", "depth+scanner")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_leads_to_a_perception_and_back(name: str) -> None:
    assert Perception.named(name).name == name


@pytest.mark.parametrize(
    "name",
    ["", "truth+scanner", "camera", "scanner+depth", "keypoints+depth", "depth+depth", "depth+"],
)
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(SimError, match="perception"):
        Perception.named(name)


def test_the_truth_has_no_use_for_a_scanner() -> None:
    with pytest.raises(SimError, match="no use for other sensors"):
        Perception.of("truth", "camera+scanner")


def test_a_scenario_without_scanners_is_refused_where_they_are_needed() -> None:
    bare = Scenario.shipped("crossing_attentive").model_copy(update={"scanners": ()})
    with pytest.raises(SimError, match="has none"):
        run_crossing(bare, policy="balanced", perception="scanner")


@pytest.mark.slow
def test_scanners_keep_somebody_who_has_left_the_picture() -> None:
    """Beside the robot the camera sees nobody; with scanners the track is fresh all the time."""
    unseen_s = {}
    scenario = Scenario.shipped("standing_in_aisle").draw(0)
    passing = scenario.model_copy(update={"duration_s": 8.0})
    for perception in ("keypoints", "keypoints+scanner"):
        result = run_crossing(passing, policy="balanced", perception=perception, seed=0)
        assert not result.contacts
        assert any(len(frame.scan_points_odom_m) for frame in result.frames) is (
            perception == "keypoints+scanner"
        )
        unseen_s[perception] = max(
            (
                track.time_since_seen_s
                for frame in result.frames
                for track in frame.tracks
                if track.status != "tentative"
            ),
            default=0.0,
        )
    assert unseen_s["keypoints"] > 1.0
    assert unseen_s["keypoints+scanner"] < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, pytest.param(5, marks=pytest.mark.full)])
def test_a_driving_robot_does_not_find_people_in_itself(seed: int) -> None:
    within: list[tuple[float, list[float]]] = []

    def look(frame, stage) -> None:
        state, corners = frame.robot_state, stage.amr.profile.footprint_m
        cos, sin = np.cos(state.heading_odom_rad), np.sin(state.heading_odom_rad)
        for track in frame.tracks:
            place = [[cos, sin], [-sin, cos]] @ (track.position_odom_m - state.position_odom_m)
            if (place > corners.min(axis=0)).all() and (place < corners.max(axis=0)).all():
                within.append((frame.t_s, place.tolist()))

    result = run_crossing(
        "late_glance", policy="balanced", perception="keypoints+scanner", seed=seed, observer=look
    )
    assert result.success
    assert not within


CONE = AttentionCone()


def test_the_oracle_sees_in_all_directions_but_not_through_racks() -> None:
    """Blind corner: the worker comes out of a cross aisle behind a rack."""
    scenario = Scenario.shipped("blind_corner")
    result = run_crossing(scenario, policy="balanced", perception="oracle")
    start = scenario.model_copy(update={"duration_s": 0.5})
    everywhere = run_crossing(start, policy="balanced", perception="truth")
    first = {
        kind: next(frame.t_s for frame in run.frames if frame.observations)
        for kind, run in (("oracle", result), ("truth", everywhere))
    }
    assert first["truth"] == 0.0
    assert first["oracle"] > 0.0
    # It reports the truth about the people it sees.
    for frame in result.frames:
        for observation, worker in zip(frame.observations, frame.observed_workers, strict=True):
            assert observation.awareness == frame.truth[worker].awareness
    # A worker behind the robot is still seen, outside the camera's field of view.
    behind = [
        observation.position_camera_m[2] < 0.0
        for frame in result.frames
        for observation in frame.observations
    ]
    assert any(behind)


def test_the_oracle_sees_everybody_who_is_not_hidden_by_a_high_box() -> None:
    scenario = Scenario.shipped("crowd_of_eight")
    with Stage(scenario, np.random.default_rng(0)) as stage:
        view = MapView.of(stage.warehouse)
        T_odom_camera = stage.amr.T_odom_camera
        truth = stage.truth(CONE, T_odom_camera)
        positions = np.array([each.position_camera_m for each in truth])
        odom = positions @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        free = view.visibility(odom, T_odom_camera) > 0.0
        near = np.linalg.norm(positions, axis=1) <= 20.0
        now = World(0.0, T_odom_camera, T_odom_camera, truth, stage.amr.state(0.0))
        for name, wanted in (("oracle", free & near), ("truth", near)):
            image, places = sensor_class(name)(setup_on(stage)).look(now)
            assert [worker for _, worker in image.observations] == np.flatnonzero(wanted).tolist()
            assert places.observations == image.observations
