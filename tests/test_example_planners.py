"""Third-party planners obey the adapter, and awareness saves time with each of them."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator

import pytest
from paths import ROOT

from nav_adapter import AwarenessPolicy
from sim_tests import NOVA_CARTER, CrossingResult, Scenario, run_crossing
from sim_tests.study.measures import fastest_point_excess_mps, limit_excess_mps

PLANNERS = {
    "ir-sim": ("irsim", "velocity_obstacles", "VelocityObstaclePlanner"),
    "do-mpc": ("do_mpc", "model_predictive", "ModelPredictivePlanner"),
}
# An episode of this planner also runs in tests/sim_tests/study/test_runs_plan.py.
FULL = pytest.param("do-mpc", marks=pytest.mark.full)


@pytest.fixture(scope="module")
def examples() -> Iterator[None]:
    """Make the examples importable, which are not part of the package."""
    sys.path.insert(0, str(ROOT))
    yield
    sys.path.remove(str(ROOT))


@pytest.fixture(scope="module", params=["ir-sim", FULL])
def make(request, examples):
    """A function that makes a planner which knows the walls, with or without the speed field."""
    package, module, name = PLANNERS[request.param]
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{request.param} is not installed (extra dev)")
    pytest.importorskip("pybullet", reason="the crossings need the extra sim")
    planner = getattr(importlib.import_module(f"examples.planners.{module}"), name)
    boxes = Scenario.shipped("crossing_attentive").draw(0).planner_boxes_odom_m
    return lambda field: planner(NOVA_CARTER, static_boxes_odom_m=boxes, use_speed_field=field)


def crossing(name: str, planner, unaware_radius_m: float = 1.0) -> CrossingResult:
    """Cross with a worker who stops 1.5 m from the path: a wide circle covers it."""
    data = Scenario.shipped(name).model_dump()
    data["people"][0]["route"][-1]["y_m"] = 1.5
    policy = AwarenessPolicy.preset("balanced").model_dump()
    policy["inflation"]["unaware_radius_m"] = unaware_radius_m
    return run_crossing(
        Scenario.model_validate(data),
        policy=AwarenessPolicy.model_validate(policy),
        planner=planner,
        population="answers=0,startles=0",  # a worker who answers would be none of these
    )


@pytest.fixture(scope="module")
def results(make) -> dict[str, CrossingResult]:
    """Crossings with circles alone: an aware worker, an unaware one, and a wider radius."""
    return {
        "aware": crossing("crossing_attentive", make(False)),
        "unaware": crossing("crossing_distracted", make(False)),
        "wide": crossing("crossing_distracted", make(False), 1.5),
    }


def test_with_the_speed_field_an_unaware_worker_costs_less_time(make, results):
    result = crossing("crossing_distracted", make(True))
    assert result.success
    assert result.violation_time_s == 0.0
    assert result.time_to_goal_s < results["unaware"].time_to_goal_s - 2.0


def test_every_crossing_ends_at_the_goal_and_obeys_limit_and_margin(results):
    for worker, result in results.items():
        assert result.success, worker
        assert not result.contact, worker
        assert limit_excess_mps(result.frames, result.robot) <= 0.03, worker
        # There was a limit to obey.
        assert min(frame.constraints.speed_limit_mps for frame in result.frames) < 1.0
        assert result.violation_time_s == 0.0, worker


def test_an_aware_worker_costs_less_time_and_a_larger_radius_gives_more_separation(results):
    aware, unaware, wide = results.values()
    assert aware.time_to_goal_s < unaware.time_to_goal_s - 3.0
    assert wide.min_separation_m > unaware.min_separation_m + 0.2


@pytest.mark.parametrize(
    ("module", "name", "package"),
    [
        pytest.param("dynamic_window", "DynamicWindow", "numpy", marks=pytest.mark.full),
        pytest.param("path_integral", "PathIntegral", "numpy", marks=pytest.mark.full),
        ("reciprocal_velocity", "ReciprocalVelocity", "pyrvo"),
    ],
)
def test_with_the_speed_field_somebody_busy_is_passed_and_corners_obey(
    module, name, package, examples
):
    pytest.importorskip("pybullet", reason="the crossings need the extra sim")
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed (extra dev)")
    planner = getattr(importlib.import_module(f"examples.planners.{module}"), name)
    scenario = Scenario.shipped("busy_in_aisle").draw(1)
    driver = planner(NOVA_CARTER, scenario.planner_boxes_odom_m)
    result = run_crossing(scenario, policy="balanced", planner=driver, seed=1)
    assert result.success
    assert not result.contact
    assert result.min_margin_m > 0.0
    excess_mps = fastest_point_excess_mps(result.frames, NOVA_CARTER)
    assert excess_mps is not None
    assert excess_mps < 0.05
