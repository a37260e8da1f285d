"""Third-party planners obey the adapter, and awareness saves time with each of them."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator

import pytest
from paths import ROOT

from sim_tests import NOVA_CARTER, ScenarioTemplate, run_crossing
from sim_tests.study.measures import fastest_point_excess_mps

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
    boxes = ScenarioTemplate.shipped("crossing_attentive").for_seed(0).planner_boxes_odom_m
    return lambda field: planner(NOVA_CARTER, static_boxes_odom_m=boxes, use_speed_field=field)


@pytest.fixture(scope="module")
def rows(make):
    """Crossings with circles alone: nobody, an aware worker, an unaware one, a wider radius."""
    compare = importlib.import_module("examples.planners._compare")
    return compare.compare("a planner", lambda: make(False))


def test_with_the_speed_field_an_unaware_worker_costs_less_time(make, rows):
    compare = importlib.import_module("examples.planners._compare")
    scenario, policy = compare.scenario("crossing_distracted"), compare.policy(1.0)
    result = run_crossing(scenario, policy=policy, planner=make(True), seed=0)
    assert result.success
    assert result.violation_time_s == 0.0
    assert result.time_to_goal_s < rows[2].result.time_to_goal_s - 2.0


def test_every_crossing_ends_at_the_goal_and_obeys_limit_and_margin(rows):
    for row in rows:
        assert row.result.success, row.worker
        assert not row.result.contact, row.worker
        assert row.excess_mps <= 0.03, row.worker
        # There was a limit to obey.
        slowest = min(frame.constraints.speed_limit_mps for frame in row.result.frames)
        assert row.worker == "nobody" or slowest < 1.0
        assert row.worker == "nobody" or row.result.violation_time_s == 0.0, row.worker


def test_an_aware_worker_costs_less_time_and_a_larger_radius_gives_more_separation(rows):
    nobody, aware, unaware, wide = (row.result for row in rows)
    assert nobody.time_to_goal_s + 0.3 < aware.time_to_goal_s < unaware.time_to_goal_s - 3.0
    assert wide.min_separation_m > unaware.min_separation_m + 0.2


@pytest.fixture
def command(examples):
    """The command of the examples."""
    pytest.importorskip("pybullet", reason="the crossings need the extra sim")
    return importlib.import_module("examples.planners.__main__").main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seed", "-1"), "--seed must be 0 or more, got -1"),
        (("--planner", "teb"), "invalid choice: 'teb'"),
        (("--out", "no/such/folder/table.md"), "a folder that exists"),
    ],
)
def test_bad_input_is_refused(command, arguments, message, capsys):
    with pytest.raises(SystemExit) as stopped:
        command(arguments)
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err


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
    scenario = ScenarioTemplate.shipped("busy_in_aisle").for_seed(1)
    driver = planner(NOVA_CARTER, scenario.planner_boxes_odom_m)
    result = run_crossing(scenario, policy="balanced", planner=driver, seed=1)
    assert result.success
    assert not result.contact
    assert result.min_margin_m > 0.0
    excess_mps = fastest_point_excess_mps(result.frames, NOVA_CARTER)
    assert excess_mps is not None
    assert excess_mps < 0.05
