"""The policy explorer gives what the adapter gives: 1 600 random states in Chromium."""

from __future__ import annotations

import json
import math
import random
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from chromium_pipe import Chromium
from explorer_cases import (
    adapters_answer,
    leaving_state,
    random_policy,
    random_robot,
    random_state,
    reserve_policy,
    round_robot,
    stopping_distance_m,
    walking_policy,
    walking_state,
)

from nav_adapter import AwarenessPolicy
from nav_adapter.ros2 import RobotFile
from nav_adapter.settled import settled_radius_m, settled_speed_limit_mps
from sim_tests.crossing import named_policy
from tracking import AwarenessFilterConfig
from tracking.awareness_filter import AwarenessBelief, estimate, evidence

STATES = 1000
POLICIES = 200
#: More of them, for people who walk.
WALKING_STATES = 400
WALKING_POLICIES = 60
WALKING_ROBOTS = 20
#: And for those who leave while the start reserve limits the robot.
LEAVING_STATES = 200
LEAVING_POLICIES = 40
ROBOTS = 50
#: The requirement; the largest difference measured is far below.
TOLERANCE = 1e-9
PRESETS = ("blind", "conservative", "balanced", "assertive")

ANSWERS = """(() => {
  const { policies, robots, cases } = %s;
  const checked = policies.map(checkedPolicy);
  return cases.map(({ policy, robot, state }) => {
    const found = answer(checked[policy], robots[robot], state);
    const polygon = obstaclePolygon(checked[policy], state, found);
    const directions = [0, 1, 2, 3, 4, 5].map((each) => (each * Math.PI) / 3 + 0.1);
    const turning = structuredClone(checked[policy]);
    turning.rules.walking = null;
    const atOnce = answer(turning, robots[robot], state);
    const budget = budgetOf(checked[policy], robots[robot], state, found);
    return {
      radius_m: found.radius_m, limit_mps: found.limit_mps, reason: found.reason,
      stopping_m: found.stopping_m, awareness_lower: found.awareness_lower, stale: found.stale,
      braking_suffices: found.braking_suffices, alert: found.alert,
      turning_raises: found.limit_mps > atOnce.limit_mps,
      turning_suffices: found.braking_suffices && !atOnce.braking_suffices,
      reserve_turns: found.bounds["start reserve"]?.turns ?? false,
      turn: turnOf(checked[policy], robots[robot], state, found.person),
      unused_m: budget.parts.reduce((left, { m }) => left - m, budget.gap),
      reach_m: directions.map((angle) => Math.max(
        ...polygon.map(([x, y]) => x * Math.cos(angle) + y * Math.sin(angle)))),
    };
  });
})()"""


def cases() -> tuple[list[AwarenessPolicy], list[dict[str, Any]], list[dict[str, Any]]]:
    draw = random.Random(23)
    policies = [named_policy(name)[1] for name in ("scanner", *PRESETS)]
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
    policies += [walking_policy(draw) for _ in range(WALKING_POLICIES)]
    robots = [random_robot(draw) for _ in range(ROBOTS)]
    robots += [round_robot(draw) for _ in range(WALKING_ROBOTS)]
    drawn = []
    walking, bodies = range(POLICIES, len(policies)), range(ROBOTS, len(robots))
    policies += [reserve_policy(draw) for _ in range(LEAVING_POLICIES)]
    leaving = range(walking.stop, len(policies))
    for count, numbers, among, state_of in (
        (STATES, range(POLICIES), range(ROBOTS), random_state),
        (WALKING_STATES, walking, bodies, walking_state),
        (LEAVING_STATES, leaving, bodies, leaving_state),
    ):
        for _ in range(count):
            number = draw.choice(numbers)
            state = state_of(draw, policies[number].timing)
            drawn.append({"policy": number, "robot": draw.choice(among), "state": state})
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
    turned: dict[str, int] = {}
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
        if rule in ("speed and separation", "start reserve") and got["limit_mps"] > 0.0:
            assert got["unused_m"] == pytest.approx(0.0, abs=TOLERANCE), case
        for effect in effects_of_walking(got, case["state"], policy):
            turned[effect] = turned.get(effect, 0) + 1
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
    # So has the rule for people who must turn round, whichever way they walk.
    assert set(turned) == {
        *("leaves", "crosses", "approaches", "stands", "braking"),
        *("reserve, turns round", "reserve, turned", "reserve, may set off faster"),
        "reserve, would be nearer",
    }
    assert min(turned.values()) >= 10, sorted(turned.items())


def effects_of_walking(
    got: dict[str, Any], state: dict[str, Any], policy: AwarenessPolicy
) -> list[str]:
    """Return what ``rules.walking`` changes in an answer, by the way in which the person walks.

    And by what it does to the start reserve, where that sets the limit.
    """
    effects = ["braking"] if got["turning_suffices"] else []
    if got["reason"] == "start reserve" and got["limit_mps"] > 0.0 and got["turn"] is not None:
        reserve, turn = policy.rules.start_reserve, got["turn"]
        assert reserve is not None
        if got["reserve_turns"]:
            effects.append(f"reserve, {'turns round' if turn['delay'] < 0.0 else 'turned'}")
        elif turn["bound"] > reserve.human_acceleration_mps2:
            if turn["delay"] < reserve.start_delay_s:
                effects.append("reserve, may set off faster")
        elif turn["delay"] < reserve.start_delay_s:
            effects.append("reserve, would be nearer")
    if not got["turning_raises"]:
        return effects
    walking_mps = math.hypot(state["vx_mps"], state["vy_mps"])
    if walking_mps == 0.0:
        return [*effects, "stands"]
    leaving_mps = state["vx_mps"] * state["x_m"] + state["vy_mps"] * state["y_m"]
    share = leaving_mps / (walking_mps * math.hypot(state["x_m"], state["y_m"]))
    return [*effects, "leaves" if share > 0.4 else "crosses" if share > -0.4 else "approaches"]


def test_people_who_walk_away_must_first_turn_round(functions: Chromium) -> None:
    """Of `balanced`, who has the rule: the page credits the turn where the adapter does."""
    policy = AwarenessPolicy.preset("balanced")
    robot = functions.evaluate("DATA.robot")
    away = functions.evaluate("stateOf(page.situation, page.robot, page.policy.filter)")
    away |= {"awareness_lower": 0.0, "x_m": 1.8, "y_m": 0.0, "vx_mps": 1.0, "vy_mps": 0.0}
    coming = {**away, "vx_mps": -1.0}
    states = {
        "leaving": away,
        "leaving, hardly known velocity": {**away, "velocity_sigma_mps": 1.0},
        "leaving, coasting": {**away, "track": "coasting"},
        "leaving, tentative": {**away, "track": "tentative"},
        "leaving, first sight": {**away, "track": "first sight"},
        "leaving, unseen for long": {**away, "unseen_s": 0.4},
        "leaving, old data": {**away, "data_age_s": 0.4},
        "coming": coming,
    }
    shown = functions.evaluate(
        f"""(() => {{
          const policy = checkedPolicy({json.dumps(policy.model_dump(mode="json"))});
          return {json.dumps(list(states.values()))}.map((state) => {{
            const found = answer(policy, page.robot, state);
            return [found.limit_mps, sentenceOf(policy, page.robot, state, found)];
          }});
        }})()"""
    )
    profile = RobotFile.model_validate(robot).profile()
    without = policy.model_copy(update={"rules": policy.rules.model_copy(update={"walking": None})})
    for (name, state), (limit_mps, sentence) in zip(states.items(), shown, strict=True):
        wanted_mps = adapters_answer(policy, profile, state).speed_limit_mps
        at_once_mps = adapters_answer(without, profile, state).speed_limit_mps
        assert limit_mps == pytest.approx(wanted_mps, abs=TOLERANCE), name
        must_turn = name == "leaving"
        assert (limit_mps > at_once_mps + 0.2) is must_turn, name
        assert ("first turn round" in sentence) is must_turn, name


def test_somebody_who_still_turns_when_the_robot_stands_has_come_no_nearer(
    functions: Chromium,
) -> None:
    policy = AwarenessPolicy.preset("balanced")
    robot = {**functions.evaluate("DATA.robot"), "reaction_time_s": 0.8}
    walks = functions.evaluate("stateOf(page.situation, page.robot, page.policy.filter)")
    walks |= {"speed_mps": 0.2, "vx_mps": 2.2, "vy_mps": 0.0, "y_m": 0.0, "awareness_lower": 0.0}
    states = [{**walks, "x_m": x_m} for x_m in np.linspace(0.8, 1.4, 25).tolist()]
    given = json.dumps([policy.model_dump(mode="json"), robot, states])
    shown = functions.evaluate(
        f"""(([policy, robot, states]) => states.map(
          (state) => answer(checkedPolicy(policy), robot, state).braking_suffices))({given})"""
    )
    profile = RobotFile.model_validate(robot).profile()
    wanted = [adapters_answer(policy, profile, state).braking_suffices for state in states]
    assert shown == wanted
    assert 3 < sum(wanted) < 22


@pytest.mark.parametrize("name", PRESETS)
def test_the_presets_give_the_values_of_policy_show(functions: Chromium, name: str) -> None:
    """Somebody who stands ahead, at an exactly known place, and has not moved."""
    alphas, gaps = [0.0, 0.3, 0.6, 0.8, 1.0], [0.0, 0.5, 1.0, 2.0, 3.0, 5.0]
    policy = AwarenessPolicy.preset(name)
    shown = functions.evaluate(
        f"""(() => {{
          const policy = checkedPolicy({json.dumps(policy.model_dump(mode="json"))});
          const still = {{
            ...page.situation, sigma_m: 0, velocity_sigma_mps: 0, moved_m: 0, speed_mps: 0,
          }};
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
