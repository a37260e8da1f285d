"""The grid proof of docs/safety.md; every term of the formula is needed for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from nav_scenes import ROBOT

from nav_adapter import NavError, max_speed_mps
from nav_adapter.proof import check_robot, check_states, gap_at_standstill_m
from perception.arrays import FloatArray

GRID = {
    "separation_m": np.concatenate([np.linspace(0.0, 4.0, 81), np.linspace(4.2, 20.0, 30)]),
    "speed_share": np.linspace(0.0, 1.0, 6),
    "human_speed_mps": np.array([0.0, 0.2, 0.35, 0.8, 1.2, 1.6, 2.0, 2.5]),
    "acceleration_mps2": np.array([0.3, 1.0, 3.0]),
    "deceleration_mps2": np.array([0.3, 0.5, 1.0, 1.5, 2.5, 4.0]),
    "reaction_time_s": np.array([0.05, 0.1, 0.3, 0.5, 1.0]),
    "clearance_m": np.array([0.05, 0.1, 0.4]),
}


def axes(every: int = 1) -> dict[str, FloatArray]:
    coarse = GRID | {"separation_m": GRID["separation_m"][::every]}
    return dict(zip(coarse, np.meshgrid(*coarse.values(), indexing="ij", sparse=True), strict=True))


TERMS: dict[str, Callable[..., FloatArray]] = {
    "S_h, reaction": lambda v, v_h, a, T, C: v_h * T + 0.0 * v,
    "S_h, braking": lambda v, v_h, a, T, C: v_h * v / a,
    "S_r": lambda v, v_h, a, T, C: v * T,
    "S_s": lambda v, v_h, a, T, C: v**2 / (2.0 * a),
    "C + Z": lambda v, v_h, a, T, C: C + 0.0 * v,
}


def limit_of(terms: dict[str, Callable[..., FloatArray]]) -> Callable[..., FloatArray]:
    """Return a limit: the highest speed whose terms fit into the separation, by bisection."""

    def limit(
        separation_m: FloatArray,
        human_speed_mps: FloatArray,
        *,
        deceleration_mps2: FloatArray,
        reaction_time_s: FloatArray,
        clearance_m: FloatArray,
    ) -> FloatArray:
        rest = human_speed_mps, deceleration_mps2, reaction_time_s, clearance_m

        def needed(speed: FloatArray) -> FloatArray:
            return sum(term(speed, *rest) for term in terms.values())

        low = np.zeros(np.broadcast(separation_m, *rest).shape)
        high = np.full_like(low, 30.0)
        for _ in range(48):
            middle = 0.5 * (low + high)
            fits = needed(middle) <= separation_m
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        # The bisection has converged to (nearly) 0 where not even a standing robot fits.
        return np.where(needed(0.0 * low) < separation_m, low, 0.0)

    return limit


def test_no_state_of_a_dense_grid_ends_in_contact_with_a_moving_robot() -> None:
    proof = check_states(**axes())
    assert proof.states >= 1_000_000
    assert proof.moving > 0.7 * proof.states
    assert proof.contacts == 0
    # The limit is not too strict either: the worst state just comes as near as allowed.
    assert proof.smallest_gap_m == pytest.approx(0.0, abs=1e-9)


def test_the_formula_with_all_its_terms_passes_the_test_for_missing_terms() -> None:
    proof = check_states(**axes(every=8), limit=limit_of(TERMS))
    assert (proof.contacts, proof.moving > 0) == (0, True)


@pytest.mark.parametrize("dropped", TERMS)
def test_without_any_one_term_there_are_contacts(dropped: str) -> None:
    kept = {name: term for name, term in TERMS.items() if name != dropped}
    proof = check_states(**axes(every=8), limit=limit_of(kept))
    assert proof.contacts > 0.3 * proof.moving
    assert proof.smallest_gap_m < -0.04


def test_gap_at_standstill_agrees_with_motion_in_small_steps() -> None:
    rng = np.random.default_rng(3)
    count, dt = 400, 2e-4
    d, v_h, T = rng.uniform(1, 8, count), rng.uniform(0, 2, count), rng.uniform(0, 0.8, count)
    up, down, top = rng.uniform(0.3, 2, count), rng.uniform(0.4, 3, count), rng.uniform(0, 2, count)
    start = top * rng.uniform(0, 1, count)
    gap, speed, t = d.copy(), start.copy(), 0.0
    while t < T.max() or (speed > 0.0).any():
        target = np.where(t < T, np.minimum(speed + up * dt, top), speed - down * dt)
        after = np.maximum(target, 0.0)
        moving = (t < T) | (speed > 0.0)
        gap -= np.where(moving, (0.5 * (speed + after) + v_h) * dt, 0.0)
        speed, t = after, t + dt
    exact = gap_at_standstill_m(
        d, start, top, v_h, acceleration_mps2=up, deceleration_mps2=down, reaction_time_s=T
    )
    np.testing.assert_allclose(gap, exact, atol=2e-3)


def worst_gap_m(delay_share: float) -> FloatArray:
    """Return the gap at standstill less C + Z, for every state of a grid, in a closed loop.

    The robot follows the limit of ``delay_share`` × T ago until it stands. A person walks straight
    at it.
    """
    dt = 2e-3
    human, down, T = (
        axis.ravel() for axis in np.meshgrid([0.0, 0.35, 1.6], [0.5, 1.0, 2.0], [0.2, 0.4, 0.8])
    )
    steps = np.maximum(np.round(delay_share * T / dt).astype(int), 1)
    gap = np.full_like(human, 12.0)
    settings = {"deceleration_mps2": down, "reaction_time_s": T, "clearance_m": 0.1}
    speed = np.minimum(max_speed_mps(gap, human, **settings), 2.0)
    past = np.tile(speed, (int(steps.max()) + 1, 1))
    everyone = np.arange(len(human))
    for tick in range(round(40.0 / dt)):
        past[tick % len(past)] = np.minimum(max_speed_mps(gap, human, **settings), 2.0)
        delayed = past[(tick - steps) % len(past), everyone]
        after = np.maximum(np.minimum(delayed, speed + 0.5 * dt), speed - down * dt)
        gap = gap - np.where(speed > 1e-3, (0.5 * (speed + after) + human) * dt, 0.0)
        speed = np.where(speed > 1e-3, after, 0.0)
    # If the person stands, the robot approaches the clearance without end.
    return gap - 0.1


def test_a_limit_followed_all_the_way_down_leaves_the_clearance_if_the_loop_is_fast() -> None:
    """With a delay of at most 0.4 of the set reaction time: docs/safety.md, assumption 3."""
    assert worst_gap_m(0.4).min() > -1e-3


def test_a_loop_as_slow_as_its_reaction_time_uses_some_of_the_clearance() -> None:
    """The robot is faster than its present limit, and needs up to 0.75 a T² more distance."""
    short_m = worst_gap_m(1.0).reshape(3, 3, 3)
    allowed_m = 0.75 * np.array([0.5, 1.0, 2.0])[:, None, None] * np.array([0.2, 0.4, 0.8]) ** 2
    assert short_m.min() < -0.02
    assert (short_m >= -allowed_m).all()


def test_a_single_robot_can_be_checked() -> None:
    proof = check_robot(ROBOT)
    assert proof.contacts == 0
    assert proof.states > 300_000
    with pytest.raises(NavError, match=r"human_speed_mps must lie in \[0, inf\), got -1"):
        check_robot(ROBOT, human_speed_mps=-1.0)
