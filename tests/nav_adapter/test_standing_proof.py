"""The grid proof for people who stand; every term of their way is needed for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from nav_scenes import ROBOT

from nav_adapter import max_speed_mps
from nav_adapter.policies import StandingPeople
from nav_adapter.proof import check_robot, check_states, gap_at_standstill_m
from perception.arrays import FloatArray

GRID = {
    "separation_m": np.concatenate([np.linspace(0.0, 4.0, 41), np.linspace(4.5, 16.0, 12)]),
    "speed_share": np.linspace(0.0, 1.0, 4),
    "human_speed_mps": np.array([0.35, 1.2, 1.6, 2.5]),
    "acceleration_mps2": np.array([0.3, 1.0, 3.0]),
    "deceleration_mps2": np.array([0.3, 0.7, 1.5, 3.0]),
    "reaction_time_s": np.array([0.05, 0.3, 0.5, 1.0]),
    "clearance_m": np.array([0.05, 0.4]),
    "human_acceleration_mps2": np.array([1.0, 2.0, 3.0, 6.0]),
    "start_delay_s": np.array([0.0, 0.1, 0.2, 0.25, 0.4]),
}


def axes(every: int = 1, **changes: FloatArray) -> dict[str, FloatArray]:
    grid = GRID | {"separation_m": GRID["separation_m"][::every]} | changes
    return dict(zip(grid, np.meshgrid(*grid.values(), indexing="ij", sparse=True), strict=True))


def way_m(since_s: FloatArray, v_h: FloatArray, a_h: FloatArray) -> FloatArray:
    return np.where(a_h * since_s < v_h, 0.5 * a_h * since_s**2, v_h * (since_s - 0.5 * v_h / a_h))


# S_h over the reaction, over braking, since the delay and with each bound on the speed.
HUMAN: dict[str, Callable[..., FloatArray]] = {
    "all terms": lambda v, v_h, a, T, a_h, delay: way_m(T + v / a + delay, v_h, a_h),
    "no reaction": lambda v, v_h, a, T, a_h, delay: way_m(v / a + delay, v_h, a_h),
    "no braking": lambda v, v_h, a, T, a_h, delay: way_m(T + delay + 0.0 * v, v_h, a_h),
    "no delay": lambda v, v_h, a, T, a_h, delay: way_m(T + v / a, v_h, a_h),
    "half the acceleration": lambda v, v_h, a, T, a_h, delay: way_m(
        T + v / a + delay, v_h, 0.5 * a_h
    ),
    "half the speed": lambda v, v_h, a, T, a_h, delay: way_m(T + v / a + delay, 0.5 * v_h, a_h),
    "no way": lambda v, v_h, a, T, a_h, delay: 0.0 * v,
}
ROBOT_TERMS: dict[str, Callable[..., FloatArray]] = {
    "S_r": lambda v, a, T, C: v * T,
    "S_s": lambda v, a, T, C: v**2 / (2.0 * a),
    "C + Z": lambda v, a, T, C: C + 0.0 * v,
}


def limit_of(human: str, robot: dict[str, Callable[..., FloatArray]]) -> Callable[..., FloatArray]:
    """Return a limit: the highest speed whose terms fit into the separation, by bisection."""

    def limit(
        separation_m: FloatArray,
        human_speed_mps: FloatArray,
        *,
        deceleration_mps2: FloatArray,
        reaction_time_s: FloatArray,
        clearance_m: FloatArray,
        human_acceleration_mps2: FloatArray,
        start_delay_s: FloatArray,
    ) -> FloatArray:
        a, T = deceleration_mps2, reaction_time_s
        start = human_acceleration_mps2, start_delay_s

        def needed(v: FloatArray) -> FloatArray:
            walked = HUMAN[human](v, human_speed_mps, a, T, *start)
            walker = human_speed_mps * (T + v / a)
            driven = sum(term(v, a, T, clearance_m) for term in robot.values())
            return np.minimum(walked, walker) + driven

        shape = np.broadcast(separation_m, human_speed_mps, a, T, clearance_m, *start).shape
        low, high = np.zeros(shape), np.full(shape, 30.0)
        for _ in range(40):
            middle = 0.5 * (low + high)
            fits = needed(middle) <= separation_m
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        return np.where(needed(np.zeros(shape)) < separation_m, low, 0.0)

    return limit


def test_no_state_with_a_standing_person_ends_in_contact_with_a_moving_robot() -> None:
    proof = check_states(**axes())
    assert proof.states >= 1_400_000
    assert proof.moving > 0.7 * proof.states
    assert proof.contacts == 0
    # The limit is not too strict either: the worst state just comes as near as allowed.
    assert proof.smallest_gap_m == pytest.approx(0.0, abs=1e-9)


# Few states, and only delays and speeds for which standing makes a difference.
FEW = {
    "human_speed_mps": np.array([1.6, 2.5]),
    "acceleration_mps2": np.array([1.0]),
    "start_delay_s": np.array([0.1, 0.25]),
    "human_acceleration_mps2": np.array([1.0, 2.0]),
}


def test_the_formula_with_all_its_terms_passes_the_test_for_missing_terms() -> None:
    few = axes(every=4, **FEW)
    proof = check_states(**few, limit=limit_of("all terms", ROBOT_TERMS))
    assert (proof.contacts, proof.moving > 0) == (0, True)


@pytest.mark.parametrize("human", [name for name in HUMAN if name != "all terms"])
def test_without_any_one_term_of_the_way_there_are_contacts(human: str) -> None:
    proof = check_states(**axes(every=4, **FEW), limit=limit_of(human, ROBOT_TERMS))
    assert proof.contacts > 0.2 * proof.moving
    assert proof.smallest_gap_m < -0.04


@pytest.mark.parametrize("dropped", ROBOT_TERMS)
def test_without_any_one_term_of_the_robot_there_are_contacts(dropped: str) -> None:
    kept = {name: term for name, term in ROBOT_TERMS.items() if name != dropped}
    proof = check_states(**axes(every=4, **FEW), limit=limit_of("all terms", kept))
    assert proof.contacts > 0.3 * proof.moving
    assert proof.smallest_gap_m < -0.04


def test_a_start_that_is_noticed_later_than_assumed_ends_in_contacts() -> None:
    """The measured delay of the tracker is what the rule stands on."""
    few = axes(every=2, **FEW)
    assumed = {name: few[name] for name in few if name not in ("speed_share", "acceleration_mps2")}
    limit = np.minimum(max_speed_mps(**assumed), 3.0)
    gap = gap_at_standstill_m(
        few["separation_m"] - few["clearance_m"],
        limit,
        limit,
        few["human_speed_mps"],
        acceleration_mps2=few["acceleration_mps2"],
        deceleration_mps2=few["deceleration_mps2"],
        reaction_time_s=few["reaction_time_s"],
        human_acceleration_mps2=few["human_acceleration_mps2"],
        start_delay_s=few["start_delay_s"] + 0.2,
    )
    assert (gap[np.broadcast_to(limit > 0.0, gap.shape)] < 0.0).mean() > 0.5


def test_the_gap_agrees_with_motion_in_small_steps() -> None:
    """The person speeds up from standing, and began to before the robot's state was taken."""
    rng = np.random.default_rng(5)
    count, dt = 300, 2e-4
    d, v_h, T = rng.uniform(1, 8, count), rng.uniform(0, 2, count), rng.uniform(0.1, 0.8, count)
    down, top = rng.uniform(0.4, 3, count), rng.uniform(0.3, 2, count)
    a_h, delay = rng.uniform(0.5, 4, count), rng.uniform(0.0, 0.5, count)
    gap, speed, t = d.copy(), top.copy(), 0.0
    walked, walking = np.zeros(count), np.zeros(count)
    for step in range(round(0.5 / dt)):
        # Before the start: only those people who have begun already.
        begun = (0.5 - step * dt) <= delay
        after = np.where(begun, np.minimum(walking + a_h * dt, v_h), walking)
        walked, walking = walked + 0.5 * (walking + after) * dt, after
    while (speed > 0.0).any():
        after_v = np.where(t < T, speed, np.maximum(speed - down * dt, 0.0))
        after_h = np.minimum(walking + a_h * dt, v_h)
        moving = speed > 0.0
        gap -= np.where(moving, 0.5 * (speed + after_v) * dt, 0.0)
        walked += np.where(moving, 0.5 * (walking + after_h) * dt, 0.0)
        speed, walking, t = after_v, after_h, t + dt
    exact = gap_at_standstill_m(
        d,
        top,
        top,
        v_h,
        acceleration_mps2=1.0,
        deceleration_mps2=down,
        reaction_time_s=T,
        human_acceleration_mps2=a_h,
        start_delay_s=delay,
    )
    np.testing.assert_allclose(gap - np.minimum(walked, v_h * (T + top / down)), exact, atol=4e-3)


def worst_gap_m(noticed_after_s: float) -> tuple[float, float]:
    """Return the smallest gap of a moving robot in a closed loop, and of one with a walker near.

    A person sets off at any time. The limit assumes that this is noticed within 0.25 s. The loop
    has a delay of 0.4 of the reaction time, as docs/safety.md, assumption 3, asks for.
    """
    dt, a_h, v_h, T = 5e-3, 2.0, 1.6, 0.3
    sets_off_s, down = (
        axis.ravel() for axis in np.meshgrid(np.arange(0.0, 12.0, 0.05), [0.5, 1.0, 2.0])
    )
    robot = {"deceleration_mps2": down, "reaction_time_s": T, "clearance_m": 0.1}
    standing = {"human_acceleration_mps2": a_h, "start_delay_s": 0.25}
    gap = np.full_like(down, 8.0)
    seen_m, worst = gap.copy(), gap.copy()
    speed, walking = np.zeros_like(gap), np.zeros_like(gap)
    lag, past = round(0.4 * T / dt), []
    met = np.zeros(len(gap), dtype=bool)
    for tick in range(round(20.0 / dt)):
        t = tick * dt
        unnoticed = t < sets_off_s + noticed_after_s
        # The track stays where the person stood until the start is noticed.
        seen_m = np.where(unnoticed, seen_m, gap)
        walker_mps = max_speed_mps(seen_m, v_h, **robot)
        allowed = np.where(unnoticed, max_speed_mps(seen_m, v_h, **robot, **standing), walker_mps)
        past.append(np.minimum(allowed, 1.5))
        limit = past[max(tick - lag, 0)]
        after = np.maximum(np.minimum(limit, speed + 1.0 * dt), speed - down * dt)
        after_h = np.where(t >= sets_off_s, np.minimum(walking + a_h * dt, v_h), 0.0)
        driven, walked = 0.5 * (speed + after) * dt, 0.5 * (walking + after_h) * dt
        moving = speed > 1e-3
        gap, seen_m = gap - driven - walked, seen_m - driven
        worst = np.where(moving, np.minimum(worst, gap), worst)
        met |= moving & (walking > 1.0)
        speed, walking = after, after_h
    return float(worst.min()), float(met.mean())


def test_a_robot_that_follows_the_limit_is_not_reached_whenever_the_person_sets_off() -> None:
    gap_m, met = worst_gap_m(noticed_after_s=0.25)
    assert met > 0.3
    assert gap_m > -1e-3


def test_a_robot_in_motion_is_reached_if_starts_are_noticed_much_later_than_assumed() -> None:
    gap_m, _ = worst_gap_m(noticed_after_s=0.75)
    assert gap_m < -0.05


def test_a_single_robot_can_be_checked_with_people_who_stand() -> None:
    proof = check_robot(ROBOT, standing=StandingPeople())
    assert proof.contacts == 0
    assert proof.moving > check_robot(ROBOT).moving
