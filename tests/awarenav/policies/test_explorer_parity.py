"""The policy explorer gives what the adapter gives: 1 000 random states in Chromium."""

from __future__ import annotations

import json
import random
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from chromium_pipe import Chromium
from explorer_cases import (
    adapters_answer,
    random_policy,
    random_robot,
    random_state,
    stopping_distance_m,
)

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import SpeedRules
from nav_adapter.ros2 import RobotFile
from nav_adapter.settled import settled_radius_m, settled_speed_limit_mps
from tracking import AwarenessFilterConfig
from tracking.awareness_filter import AwarenessBelief, estimate, evidence

STATES = 1000
POLICIES = 200
ROBOTS = 50
#: The requirement; the largest difference measured is far below.
TOLERANCE = 1e-9
PRESETS = ("scanner", "blind", "conservative", "balanced", "assertive")

ANSWERS = """(() => {
  const { policies, robots, cases } = %s;
  const checked = policies.map(checkedPolicy);
  return cases.map(({ policy, robot, state }) => {
    const found = answer(checked[policy], robots[robot], state);
    const polygon = obstaclePolygon(checked[policy], state, found);
    const directions = [0, 1, 2, 3, 4, 5].map((each) => (each * Math.PI) / 3 + 0.1);
    return {
      radius_m: found.radius_m, limit_mps: found.limit_mps, reason: found.reason,
      stopping_m: found.stopping_m, awareness_lower: found.awareness_lower, stale: found.stale,
      braking_suffices: found.braking_suffices, alert: found.alert,
      reach_m: directions.map((angle) => Math.max(
        ...polygon.map(([x, y]) => x * Math.cos(angle) + y * Math.sin(angle)))),
    };
  });
})()"""


def cases() -> tuple[list[AwarenessPolicy], list[dict[str, Any]], list[dict[str, Any]]]:
    draw = random.Random(23)
    policies = [AwarenessPolicy.preset(name) for name in PRESETS]
    # Repeated alerts only, as in the random policies.
    policies = [
        policy.model_copy(
            update={
                "alerts": policy.alerts
                and policy.alerts.model_copy(update={"repeat_after_s": 0.0, "quiet_s": 0.0})
            }
        )
        for policy in policies
    ]
    policies += [random_policy(draw) for _ in range(POLICIES - len(policies))]
    robots = [random_robot(draw) for _ in range(ROBOTS)]
    drawn = []
    for _ in range(STATES):
        number = draw.randrange(POLICIES)
        state = random_state(draw, policies[number].timing)
        drawn.append({"policy": number, "robot": draw.randrange(ROBOTS), "state": state})
    return policies, robots, drawn


def test_radius_limit_reason_and_stopping_distance_are_those_of_the_adapter(
    functions: Chromium,
) -> None:
    policies, robots, drawn = cases()
    data = {
        "policies": [policy.model_dump(mode="json") for policy in policies],
        "robots": robots,
        "cases": drawn,
    }
    shown = functions.evaluate(ANSWERS % json.dumps(data))
    profiles = [RobotFile.model_validate(robot).profile() for robot in robots]
    angles = np.arange(6) * (np.pi / 3.0) + 0.1
    directions = np.stack([np.cos(angles), np.sin(angles)])
    reasons: dict[str, int] = {}
    for case, got in zip(drawn, shown, strict=True):
        policy, robot = policies[case["policy"]], profiles[case["robot"]]
        wanted = adapters_answer(policy, robot, case["state"])
        (obstacle,) = wanted.obstacles
        corners = np.asarray(obstacle.polygon.exterior.coords)
        rule = wanted.limited_by.removeprefix("track 1: ")
        reasons[rule.partition(":")[0]] = reasons.get(rule.partition(":")[0], 0) + 1
        stopping_m = stopping_distance_m(robot, wanted.speed_limit_mps, case["state"]["data_age_s"])
        assert got["reason"] == rule, case
        assert got["limit_mps"] == pytest.approx(wanted.speed_limit_mps, rel=0, abs=TOLERANCE), case
        assert got["radius_m"] == pytest.approx(obstacle.radius_m, rel=0, abs=TOLERANCE), case
        assert got["stopping_m"] == pytest.approx(stopping_m, rel=0, abs=TOLERANCE), case
        assert got["awareness_lower"] == obstacle.awareness_lower, case
        assert got["stale"] == wanted.stale, case
        assert got["braking_suffices"] == wanted.braking_suffices, case
        assert got["reach_m"] == pytest.approx((corners @ directions).max(axis=0), abs=1e-9), case
        (alert,) = wanted.alerts or (None,)
        assert (got["alert"] or {}).get("kind") == (alert and alert.kind), case
        if alert is not None:
            assert got["alert"]["time_s"] == pytest.approx(alert.time_to_closest_s, abs=1e-9)
            assert got["alert"]["gap_m"] == pytest.approx(alert.closest_gap_m, abs=1e-9)
    # Every rule and every refusal to drive has been met.
    assert set(reasons) == {
        *("speed and separation", "start reserve", "distance zone", "cap near people"),
        *("robot maximum", "stale data", "robot"),
    }
    assert min(reasons.values()) >= 10, reasons


@pytest.mark.parametrize("name", PRESETS)
def test_the_presets_give_the_values_of_policy_show(functions: Chromium, name: str) -> None:
    """The controls as they stand: someone who stands ahead, at an exactly known place."""
    alphas, gaps = [0.0, 0.3, 0.6, 0.8, 1.0], [0.0, 0.5, 1.0, 2.0, 3.0, 5.0]
    policy = AwarenessPolicy.preset(name).model_copy(update={"rules": without_reserve(name)})
    shown = functions.evaluate(
        f"""(() => {{
          const policy = checkedPolicy({json.dumps(policy.model_dump(mode="json"))});
          const still = {{ ...page.situation, sigma_m: 0, velocity_sigma_mps: 0, speed_mps: 0 }};
          return {json.dumps(alphas)}.map((alpha) => {json.dumps(gaps)}.map((gap_m) => {{
            const situation = {{ ...still, awareness_lower: alpha, gap_m }};
            const found = answerIn({{ policy, robot: page.robot, situation }});
            return [found.limit_mps, found.radius_m];
          }}));
        }})()"""
    )
    robot = RobotFile.model_validate(functions.evaluate("DATA.robot")).profile()
    limits = settled_speed_limit_mps(policy, robot, np.array(gaps), np.array(alphas)[:, None])
    radii = settled_radius_m(policy, alphas)
    assert np.array(shown)[..., 0] == pytest.approx(limits, abs=1e-9)
    assert np.array(shown)[..., 1] == pytest.approx(np.tile(radii[:, None], len(gaps)), abs=1e-9)


def without_reserve(name: str) -> SpeedRules:
    """Return the rules of a preset without the reserve, which ``policy show`` leaves out."""
    return AwarenessPolicy.preset(name).rules.model_copy(update={"start_reserve": None})


def test_the_bound_of_one_measurement_is_that_of_the_awareness_filter(functions: Chromium) -> None:
    draw = random.Random(5)
    given = [
        {
            "alpha": draw.random(),
            "std": draw.uniform(0.0, 0.5),
            "filter": {
                "clip_awareness": draw.uniform(1e-6, 0.2),
                "min_evidence_std_logit": draw.uniform(1e-3, 2.0),
                "max_evidence_std": draw.uniform(0.05, 0.5),
                "lower_bound_confidence": draw.choice([0.5, 0.9, draw.uniform(0.5, 0.999999)]),
            },
        }
        for _ in range(300)
    ]
    shown = functions.evaluate(
        f"{json.dumps(given)}.map(({{alpha, std, filter}}) => lowerBound(alpha, std, filter))"
    )
    some = 0
    for case, bound in zip(given, shown, strict=True):
        config = AwarenessFilterConfig(**case["filter"])
        mean, variance = evidence(case["alpha"], case["std"], config)
        if np.isnan(mean):
            assert bound == 0.0
            continue
        wanted = bound_after(mean, variance, config)
        some += wanted > 0.0
        assert bound == pytest.approx(wanted, abs=1e-9), case
    assert some > 60


def bound_after(mean: Any, variance: Any, config: AwarenessFilterConfig) -> float:
    """Return the lower bound of a belief that has just been measured."""
    z = NormalDist().inv_cdf(config.lower_bound_confidence)
    belief = AwarenessBelief(mean, variance, mean - z * np.sqrt(variance))
    return float(estimate(belief, config).awareness_lower)
