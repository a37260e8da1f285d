"""Closed loop: what a crossing must do, with the truth, with keypoints and with pixels."""

import math

import numpy as np
import pytest

from nav_adapter import AwarenessPolicy, NavError
from sim_tests import KeypointNoise, Scenario, SimError, run_crossing
from sim_tests.demo._encounter import CASES, case_values
from sim_tests.demo._tables import EpisodeTable, episode_row
from sim_tests.world.camera import CameraTiming

ATTENTIVE = Scenario.shipped("crossing_attentive")
DISTRACTED = Scenario.shipped("crossing_distracted")


PIXELS = pytest.param("pixels", marks=pytest.mark.slow)


@pytest.fixture(scope="module", params=["truth", "keypoints", PIXELS])
def comparison(request):
    """Nobody there, blind, aware of an attentive worker, aware of a distracted worker."""
    options = {"perception": request.param, "seed": 3}
    return (
        run_crossing(ATTENTIVE.without_people(), policy="balanced", **options),
        run_crossing(ATTENTIVE, policy="blind", **options),
        run_crossing(ATTENTIVE, policy="balanced", **options),
        run_crossing(DISTRACTED, policy="balanced", **options),
    )


def test_all_reach_the_goal_and_the_robot_touches_nobody(comparison):
    for result in comparison:
        assert result.success
        assert result.time_to_goal_s is not None
        assert not result.contact


def test_awareness_wins_back_a_quarter_of_the_delay(comparison):
    free, blind, attentive, _ = (result.time_to_goal_s for result in comparison)
    assert blind > free + 1.0
    assert blind - attentive >= 0.25 * (blind - free)


def test_a_distracted_worker_is_as_safe_as_with_a_blind_robot(comparison):
    _, blind, _, distracted = comparison
    assert distracted.violation_time_s == 0.0
    assert distracted.min_margin_m >= 0.0
    assert distracted.min_separation_m >= blind.min_separation_m - 0.1


def test_the_robot_obeys_the_limit_that_it_was_given(comparison):
    """Within what braking allows: the limit may fall faster than the robot can."""
    for result in comparison:
        for before, after in zip(result.frames, result.frames[1:], strict=False):
            allowed = max(
                before.constraints.speed_limit_mps, before.robot_state.speed_mps - 1.0 * 0.05
            )
            assert after.robot_state.speed_mps <= allowed + 0.03


def test_the_distracted_worker_is_never_taken_for_aware(comparison):
    for frame in comparison[3].frames:
        for obstacle in frame.constraints.obstacles:
            assert obstacle.awareness_lower < 0.3


def test_attentive_and_distracted_workers_walk_the_same_way(comparison):
    ours, theirs = (
        np.array([f.truth[0].position_odom_m for f in result.frames[:200]])
        for result in comparison[2:]
    )
    np.testing.assert_allclose(ours, theirs)


@pytest.fixture(scope="module")
def encounter():
    return run_crossing("paper_encounter", policy="balanced", perception="keypoints", seed=0)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.meaning)
@pytest.mark.parametrize(
    ("perception", "alpha_tolerance", "distance_tolerance_m"),
    [("truth", 0.02, 0.05), ("keypoints", 0.10, 0.12)],
)
def test_the_papers_encounter(encounter, case, perception, alpha_tolerance, distance_tolerance_m):
    (row,) = [r for r in case_values(encounter) if r[0] is case and r[1] == perception]
    _, _, alpha, forward, lateral = row
    assert alpha == pytest.approx(case.awareness, abs=alpha_tolerance)
    assert forward == pytest.approx(case.d_fwd_m, abs=distance_tolerance_m)
    assert lateral == pytest.approx(case.d_lat_m, abs=distance_tolerance_m)


@pytest.fixture(scope="module")
def encounter_in_pixels():
    # The last of the paper's three cases is at 16.25 s.
    scenario = Scenario.shipped("paper_encounter").model_copy(update={"duration_s": 16.5})
    return run_crossing(scenario, policy="balanced", perception="pixels", seed=0)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.meaning)
def test_the_papers_encounter_in_pixels(encounter_in_pixels, case):
    (row,) = [r for r in case_values(encounter_in_pixels) if r[0] is case and r[1] == "pixels"]
    _, _, alpha, forward, lateral = row
    assert alpha == pytest.approx(case.awareness, abs=0.10)
    assert forward == pytest.approx(case.d_fwd_m, abs=0.15)
    assert lateral == pytest.approx(case.d_lat_m, abs=0.15)


def test_the_encounter_has_a_frame_for_every_sixtieth_of_its_25_seconds(encounter):
    assert len(encounter.frames) == 1500
    assert encounter.frames[-1].t_s == pytest.approx(25.0 - 1.0 / 60.0)


def test_awareness_from_keypoints_follows_the_truth(encounter):
    """Over the whole encounter, front, profile and back: small errors, honest spread."""
    pairs = [
        (frame.truth[0].awareness, seen.awareness, seen.awareness_std)
        for frame in encounter.frames
        if (seen := frame.observation_of(0)) is not None and seen.awareness is not None
    ]
    truth, alpha, std = np.array(pairs).T
    assert len(truth) > 1000
    assert np.mean(np.abs(alpha - truth)) < 0.03
    assert np.percentile(np.abs(alpha - truth), 95) < 0.12
    assert not np.any((alpha - 1.28 * std > 0.3) & (truth == 0.0))
    partly = (truth > 0.1) & (truth < 0.9)
    assert 0.5 < np.mean(np.abs(alpha - truth)[partly] < std[partly]) < 0.85


def test_true_awareness_needs_a_line_of_sight():
    """Behind the rack the worker looks the robot's way and sees the rack."""
    result = run_crossing(ATTENTIVE.model_copy(update={"duration_s": 1.5}), policy="balanced")
    alphas = [frame.truth[0].awareness for frame in result.frames]
    assert alphas[0] == 0.0
    assert max(alphas) > 0.9


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(tmp_path):
    short = ATTENTIVE.model_copy(update={"duration_s": 4.0})
    texts = []
    for run, seed in enumerate((5, 5, 6)):
        path = tmp_path / f"{run}.csv"
        with EpisodeTable(path) as table:
            table.add(run_crossing(short, policy="balanced", perception="keypoints", seed=seed))
        texts.append(path.read_bytes())
    assert texts[0] == texts[1]
    assert texts[0] != texts[2].replace(b",6,", b",5,", 1)


def test_noise_and_missed_people_cost_time_not_clearance():
    rough = KeypointNoise(pixel_std_px=3.0, miss_rate=0.4)
    result = run_crossing(
        DISTRACTED, policy="balanced", perception="keypoints", seed=1, noise=rough
    )
    assert result.success
    assert result.contact_by != "robot"
    assert result.violation_time_s == 0.0


def test_a_runner_who_leaves_the_view_as_he_sets_off_is_not_driven_into():
    """He comes faster than anybody out of sight is assumed to; the doubt about his place counts."""
    result = run_crossing("runs_out", policy="balanced", perception="keypoints", seed=4)
    assert not result.contact
    assert result.success


def with_timing(scenario, **timing):
    camera = scenario.camera.model_copy(update={"timing": CameraTiming(**timing)})
    return scenario.model_copy(update={"camera": camera})


def test_late_and_lost_frames_cost_time_not_clearance():
    slow = with_timing(DISTRACTED, latency_s=0.2, latency_jitter_s=0.1, drop_rate=0.2)
    result = run_crossing(slow, policy="balanced", perception="truth", seed=2)
    prompt = run_crossing(DISTRACTED, policy="balanced", perception="truth", seed=2)
    assert not result.contact
    assert result.success
    assert result.time_to_goal_s >= prompt.time_to_goal_s - 0.2
    # Nothing is known before the first frame has arrived, so the robot waits for it.
    waiting = [f for f in result.frames if f.t_s < 0.2]
    assert waiting
    assert all(f.constraints.stale and f.command[0] == 0.0 for f in waiting)


def test_a_camera_with_its_own_rate_sees_no_more_often():
    result = run_crossing(
        with_timing(ATTENTIVE, rate_hz=5.0), policy="balanced", perception="truth", seed=0
    )
    seen = [frame.t_s for frame in result.frames if frame.observations]
    assert np.diff(seen) == pytest.approx(0.2)
    assert result.success


def test_a_dead_camera_keeps_the_robot_where_it_is():
    scenario = with_timing(DISTRACTED, drop_rate=1.0).model_copy(update={"duration_s": 3.0})
    result = run_crossing(scenario, policy="balanced", perception="truth", seed=0)
    assert not result.success
    start, end = (result.frames[k].robot_state.position_odom_m for k in (0, -1))
    assert np.linalg.norm(end - start) < 0.01


def test_a_planner_of_ones_own_is_driven_by_and_named():
    class Careful:
        calls = 0

        def plan(self, robot_state, goal_odom_m, constraints, dt_s):
            Careful.calls += 1
            return min(0.4, constraints.speed_limit_mps), 0.0

    short = ATTENTIVE.model_copy(update={"duration_s": 3.0})
    result = run_crossing(short, policy="balanced", planner=Careful())
    assert result.planner == "Careful"
    assert Careful.calls == len(result.frames) == 60
    assert result.frames[-1].robot_state.speed_mps == pytest.approx(0.4, abs=0.02)
    assert not result.success
    assert result.time_to_goal_s is None


def test_a_robot_that_ignores_everything_runs_into_a_person_and_is_blamed():
    """The measuring side works: without a planner that yields there is a robot-caused contact."""
    standing = ATTENTIVE.workers[0].model_copy(
        update={"path": (ATTENTIVE.workers[0].path[0].model_copy(update={"x_m": 3.0, "y_m": 0.0}),)}
    )
    reckless = ATTENTIVE.model_copy(
        update={
            "workers": (standing,),
            "robot": ATTENTIVE.robot.model_copy(update={"straight_on_speed_mps": 0.8}),
            "duration_s": 5.0,
        }
    )
    result = run_crossing(reckless, policy="balanced")
    assert result.contact_by == "robot"
    assert result.contacts[0].robot_speed_mps > 0.5
    assert result.min_separation_m < 0.05
    assert result.violation_time_s > 0.5
    assert not result.success


def test_policies_come_by_name_by_file_and_as_objects(tmp_path):
    short = ATTENTIVE.model_copy(update={"duration_s": 0.5})
    path = tmp_path / "mine.yaml"
    AwarenessPolicy.preset("blind").to_yaml(path)
    names = [
        run_crossing(short, policy=policy).policy
        for policy in ("blind", path, AwarenessPolicy.preset("blind"))
    ]
    assert names == ["blind", "mine", "custom"]


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"scenario": "crossing_attentiv"}, SimError, "did you mean 'crossing_attentive'"),
        ({"policy": "balancd"}, NavError, "balanced"),
        ({"perception": "radar"}, SimError, "'truth', 'keypoints', 'pixels'"),
    ],
)
def test_unknown_names_are_refused(change, error, message):
    options = {"scenario": "crossing_attentive", "policy": "balanced"} | change
    scenario = options.pop("scenario")
    with pytest.raises(error, match=message):
        run_crossing(scenario, **options)


def test_rows_have_no_infinities():
    empty = run_crossing(
        ATTENTIVE.without_people().model_copy(update={"duration_s": 0.5}), policy="balanced"
    )
    assert math.isinf(empty.min_separation_m)
    assert "inf" not in episode_row(empty)
