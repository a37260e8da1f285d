"""Closed-loop crossings with the truth, with keypoints and with pixels."""

from functools import cache

import numpy as np
import pytest

from nav_adapter import NavError
from sim_tests import Scenario, SimError, run_crossing
from sim_tests.actors.behaviour import Glances
from sim_tests.study.measures import measure, write_records
from sim_tests.world.camera import CameraTiming

ATTENTIVE = Scenario.shipped("crossing_attentive")
DISTRACTED = Scenario.shipped("crossing_distracted")


# The test below runs the crossing of the attentive worker in pixels, a quarter of this. What holds
# with noisy keypoints holds with the truth, too.
FULL = [pytest.param((name, name), marks=pytest.mark.full) for name in ("truth", "pixels+scanner")]


@cache
def blind(perception, seed):
    """Awareness changes nothing here, so that the truth does where time counts."""
    return run_crossing(ATTENTIVE, policy="blind", perception=perception, seed=seed)


@pytest.fixture(scope="module", params=[("keypoints+scanner", "truth"), *FULL])
def comparison(request):
    """Nobody there, blind, aware of an attentive worker, aware of a distracted worker."""
    perception, of_the_first = request.param
    options = {"perception": perception, "seed": 3}
    nobody = ATTENTIVE.without_people()
    return (
        run_crossing(nobody, policy="balanced", perception=of_the_first, seed=3),
        blind(of_the_first, 3),
        run_crossing(ATTENTIVE, policy="balanced", **options),
        run_crossing(DISTRACTED, policy="balanced", **options),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seeds", "blind_sees", "rate_hz"),
    [
        # A blind crossing in pixels takes half a minute more; this one knows the truth.
        ((3,), "truth", 10.0),
        pytest.param((1, 2, 3), "pixels+scanner", None, marks=pytest.mark.full),
    ],
)
def test_in_pixels_awareness_of_an_attentive_worker_saves_time(seeds, blind_sees, rate_hz):
    """In the median: a false track beside who leaves the picture may cost the gain of a run.

    Scanners hold the worker beside the robot. A camera alone loses them there, and wins nothing.
    """
    scenario = with_timing(ATTENTIVE, rate_hz=rate_hz)
    saved_s = []
    for seed in seeds:
        result = run_crossing(scenario, policy="balanced", perception="pixels+scanner", seed=seed)
        assert result.success
        assert not result.contact
        assert result.violation_time_s == 0.0
        saved_s.append(blind(blind_sees, seed).time_to_goal_s - result.time_to_goal_s)
    assert np.median(saved_s) > 0.1


def test_all_reach_the_goal_and_the_robot_touches_nobody(comparison):
    for result in comparison:
        assert result.success
        assert result.time_to_goal_s is not None
        assert not result.contact


def test_awareness_saves_a_quarter_of_the_delay(comparison):
    """A camera alone loses the worker beside the robot, who is unaware then, and wins nothing."""
    empty, blind, attentive, _ = (result.time_to_goal_s for result in comparison)
    assert blind > empty + 0.5
    assert blind - attentive >= 0.25 * (blind - empty)


def test_a_distracted_worker_is_as_safe_as_with_a_blind_robot(comparison):
    _, blind, _, distracted = comparison
    assert distracted.violation_time_s == 0.0
    assert distracted.min_margin_m >= 0.0
    assert distracted.min_separation_m >= blind.min_separation_m - 0.1


def test_the_robot_obeys_the_speed_limit(comparison):
    """As far as braking allows: the limit may fall faster than the robot can brake."""
    for result in comparison:
        for before, after in zip(result.frames, result.frames[1:], strict=False):
            highest = max(
                before.constraints.speed_limit_mps, before.robot_state.speed_mps - 1.0 * 0.05
            )
            assert after.robot_state.speed_mps <= highest + 0.03


def test_the_distracted_worker_never_counts_as_aware(comparison):
    for frame in comparison[3].frames:
        for obstacle in frame.constraints.obstacles:
            assert obstacle.awareness_lower < 0.3


def test_true_awareness_needs_a_line_of_sight():
    """Behind the rack the worker looks towards the robot and sees only the rack."""
    result = run_crossing(ATTENTIVE.model_copy(update={"duration_s": 1.5}), policy="balanced")
    alphas = [frame.truth[0].awareness for frame in result.frames]
    assert alphas[0] == 0.0
    assert max(alphas) > 0.9


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not(tmp_path):
    short = ATTENTIVE.model_copy(update={"duration_s": 2.0})
    texts = []
    for run, seed in enumerate((5, 5, 6)):
        path = tmp_path / f"{run}.csv"
        result = run_crossing(short, policy="balanced", perception="keypoints", seed=seed)
        write_records(path, [measure(result)])
        texts.append(path.read_bytes())
    assert texts[0] == texts[1]
    assert texts[0] != texts[2].replace(b",6,", b",5,", 1)


def test_the_robot_avoids_a_runner_who_leaves_the_view_at_the_start():
    """The runner is faster than assumed for people out of view; the position covariance counts."""
    result = run_crossing("runs_out", policy="balanced", perception="keypoints", seed=4)
    assert not result.contact
    assert result.success


def with_timing(scenario, **timing):
    camera = scenario.camera.model_copy(update={"timing": CameraTiming(**timing)})
    return scenario.model_copy(update={"camera": camera})


def test_late_and_lost_images_cost_time_but_no_clearance():
    slow = with_timing(DISTRACTED, latency_s=0.2, latency_jitter_s=0.1, drop_rate=0.2)
    result = run_crossing(slow, policy="balanced", perception="truth", seed=2)
    prompt = run_crossing(DISTRACTED, policy="balanced", perception="truth", seed=2)
    assert not result.contact
    assert result.success
    assert result.time_to_goal_s >= prompt.time_to_goal_s - 0.2
    # Before the first image has arrived nothing is known, so the robot waits.
    waiting = [f for f in result.frames if f.t_s < 0.2]
    assert waiting
    assert all(f.constraints.stale and f.command[0] == 0.0 for f in waiting)


def test_a_custom_planner_drives_the_robot_and_is_named_in_the_result():
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


def test_a_robot_that_ignores_people_causes_a_contact_and_is_named_as_its_cause():
    """The metrics work: without a planner that avoids people the robot causes a contact."""
    (worker,) = ATTENTIVE.people
    here = worker.route[0].model_copy(update={"x_m": 3.0, "y_m": 0.0})
    standing = worker.model_copy(
        update={"route": (here,), "glances": Glances(notices_within_m=0.0)}
    )
    reckless = ATTENTIVE.model_copy(
        update={
            "people": (standing,),
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


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"scenario": "crossing_attentiv"}, SimError, "did you mean 'crossing_attentive'"),
        (
            {"policy": "scaner"},
            NavError,
            "policy 'scaner' is unknown; did you mean 'scanner'.*'blind'",
        ),
        ({"perception": "radar"}, SimError, "'truth', 'keypoints', 'pixels'"),
        ({"seed": -1}, SimError, "seed must be 0 or more, got -1"),
    ],
)
def test_unknown_names_and_seeds_are_refused_with_the_valid_ones(change, error, message):
    options = {"scenario": "crossing_attentive"} | change
    scenario = options.pop("scenario")
    with pytest.raises(error, match=message):
        run_crossing(scenario, **options)
