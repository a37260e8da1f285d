"""The sensors of a crossing's robot by the name of its perception."""

from __future__ import annotations

import pytest

from sim_tests import Scenario, SimError, run_crossing
from sim_tests.crossing.eyes import ORACLE, Perception
from sim_tests.study.runs import plan_jobs

NAMES = ("truth", "keypoints", "pixels", "keypoints+scanner", "pixels+scanner", "scanner", ORACLE)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_leads_to_a_perception_and_back(name: str) -> None:
    assert Perception.named(name).name == name


@pytest.mark.parametrize("name", ["", "truth+scanner", "oracle+scanner", "camera", "lidar"])
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(SimError, match="perception"):
        Perception.named(name)


def test_the_truth_has_no_use_for_a_scanner() -> None:
    with pytest.raises(SimError, match="no use for a scanner"):
        Perception.of("truth", "camera+scanner")


def test_several_sets_of_sensors_are_compared() -> None:
    sets = ("camera", "camera+scanner", "scanner")
    jobs = plan_jobs(["crossing_attentive"], ["balanced", ORACLE], [0], sensors=sets)
    perceptions = [(job.policy_name, job.perception) for job in jobs]
    assert perceptions == [
        ("balanced", "keypoints"),
        ("balanced", "keypoints+scanner"),
        ("balanced", "scanner"),
        (ORACLE, ORACLE),
    ]


def test_a_scenario_without_scanners_is_refused_where_they_are_needed() -> None:
    bare = Scenario.shipped("crossing_attentive").model_copy(update={"scanners": ()})
    with pytest.raises(SimError, match="has none"):
        run_crossing(bare, policy="balanced", perception="scanner")


@pytest.mark.slow
def test_scanners_keep_somebody_who_has_left_the_picture() -> None:
    """Beside the robot the camera sees nobody; with scanners the track is fresh all the time."""
    unseen_s = {}
    for perception in ("keypoints", "keypoints+scanner"):
        result = run_crossing("standing_in_aisle", policy="balanced", perception=perception, seed=0)
        assert not result.contacts
        assert any(len(frame.scan_points_odom_m) for frame in result.frames) is (
            perception == "keypoints+scanner"
        )
        unseen_s[perception] = max(
            (
                track.time_since_seen_s
                for frame in result.frames
                for track in frame.tracks
                if track.status != "tentative" and frame.t_s < 8.0
            ),
            default=0.0,
        )
    assert unseen_s["keypoints"] > 1.0
    assert unseen_s["keypoints+scanner"] < 0.3
