"""Speed and separation for people who stand: the way, its inverse, and what does not change."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import finite
from scipy.integrate import quad
from scipy.optimize import brentq

from nav_adapter import NavError, max_speed_mps, protective_separation_m

ROBOT = {
    "deceleration_mps2": finite(0.2, 4.0),
    "reaction_time_s": finite(0.0, 1.5),
    "clearance_m": finite(0.0, 1.0),
    "approach": finite(0.0, 1.0),
}
START = {"human_acceleration_mps2": finite(0.2, 10.0), "start_delay_s": finite(0.0, 1.0)}


def test_published_figures_of_a_standing_person() -> None:
    """At 1.6 m/s, 2 m/s² and 0.25 s the person is 0.24 m nearer to where they stood."""
    robot = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
    start = {"human_acceleration_mps2": 2.0, "start_delay_s": 0.25}
    walking = protective_separation_m(1.0, 1.6, **robot)
    assert walking - protective_separation_m(1.0, 1.6, **robot, **start) == pytest.approx(0.24)
    limits = max_speed_mps([1.0, 2.0, 3.0, 5.0], 1.6, **robot, **start)
    np.testing.assert_allclose(limits, [0.32, 0.73, 1.09, 1.70], atol=0.005)


@given(
    speed=finite(0.0, 3.0),
    human=finite(0.0, 3.0),
    reaction=finite(0.0, 1.5),
    acceleration=finite(0.2, 10.0),
    delay=finite(0.0, 1.0),
)
def test_the_way_is_the_integral_of_the_speed_since_the_start(
    speed: float, human: float, reaction: float, acceleration: float, delay: float
) -> None:
    robot = {"deceleration_mps2": 1.0, "reaction_time_s": reaction, "clearance_m": 0.0}
    start = {"human_acceleration_mps2": acceleration, "start_delay_s": delay}
    walked = float(protective_separation_m(speed, human, **robot, **start, approach=0.0))
    end, bend = reaction + speed + delay, human / acceleration
    way, _ = quad(lambda t: min(acceleration * t, human), 0.0, end, points=[min(bend, end)])
    assert walked == pytest.approx(min(way, human * (reaction + speed)), abs=1e-9)


@given(
    separation=st.just(0.0) | finite(1e-9, 30.0),
    human=st.just(0.0) | finite(1e-9, 3.0),
    **{**ROBOT, "approach": st.just(0.0) | finite(1e-9, 1.0)},
    **START,
)
def test_the_limit_is_the_root_of_the_protective_separation(
    separation: float, human: float, **settings: float
) -> None:
    def spare(speed: float) -> float:
        return separation - float(protective_separation_m(speed, human, **settings))

    limit = float(max_speed_mps(separation, human, **settings))
    if spare(0.0) <= 0.0:
        assert limit == 0.0
    elif spare(1000.0) > 0.0:
        assert limit > 1000.0 - 1e-6
    else:
        assert limit == pytest.approx(brentq(spare, 0.0, 1000.0, xtol=1e-12), abs=1e-7)


@given(
    separation=finite(-1.0, 20.0),
    human=finite(0.01, 3.0),
    more=finite(0.0, 2.0),
    **ROBOT,
    **START,
)
def test_the_limit_is_monotone_in_every_argument(
    separation: float, human: float, more: float, **settings: float
) -> None:
    here = float(max_speed_mps(separation, human, **settings))
    # Two roots of nearly equal size may differ by rounding.
    rounding = 1e-9 * max(1.0, here)
    assert max_speed_mps(separation + more, human, **settings) >= here - rounding
    assert max_speed_mps(separation, human + more, **settings) <= here + rounding
    for name in ("reaction_time_s", "clearance_m", *START):
        grown = settings | {name: settings[name] + more}
        assert max_speed_mps(separation, human, **grown) <= here + rounding, name
    nearer = settings | {"approach": min(settings["approach"] + more, 1.0)}
    assert max_speed_mps(separation, human, **nearer) <= here + rounding
    harder = settings | {"deceleration_mps2": settings["deceleration_mps2"] + more}
    assert max_speed_mps(separation, human, **harder) >= here - rounding
    walking = {name: value for name, value in settings.items() if name not in START}
    assert here >= max_speed_mps(separation, human, **walking)


def test_without_a_bound_the_limit_is_that_of_a_walker_to_the_bit() -> None:
    rng = np.random.default_rng(1)
    separation, human, share = rng.uniform([-1, 0, 0], [9, 3, 1], (500, 3)).T
    robot = {"deceleration_mps2": 0.7, "reaction_time_s": 0.3, "clearance_m": 0.1}
    walker = max_speed_mps(separation, human, **robot, approach=share)
    a_h = np.where(np.arange(500) % 2, np.inf, 2.0)
    mixed = max_speed_mps(
        separation,
        human,
        **robot,
        approach=share,
        human_acceleration_mps2=a_h,
        start_delay_s=np.where(np.arange(500) % 4, 0.1, np.inf),
    )
    off = ~np.isfinite(a_h) | (np.arange(500) % 4 == 0)
    assert (mixed[off] == walker[off]).all()
    assert (mixed[~off] > walker[~off]).mean() > 0.4
    # A start that is noticed too late is worth nothing, to the bit.
    late = max_speed_mps(
        separation, human, **robot, approach=share, human_acceleration_mps2=2.0, start_delay_s=0.8
    )
    np.testing.assert_array_equal(late, walker)


def test_an_unknown_distance_gives_a_limit_of_0() -> None:
    robot = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
    assert max_speed_mps(np.nan, 1.6, **robot, human_acceleration_mps2=2.0) == 0.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"human_acceleration_mps2": 0.0}, "human_acceleration_mps2 must be > 0 m/s², got 0.0"),
        ({"human_acceleration_mps2": np.nan}, "human_acceleration_mps2 must be > 0 m/s², got nan"),
        (
            {"human_acceleration_mps2": 2.0, "start_delay_s": -0.1},
            "start_delay_s must be >= 0 s, got -0.1",
        ),
    ],
)
def test_impossible_starts_are_refused(settings: dict[str, float], message: str) -> None:
    rest = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
    with pytest.raises(NavError, match=message):
        max_speed_mps(3.0, 1.6, **rest, **settings)
    with pytest.raises(NavError, match=message):
        protective_separation_m(1.0, 1.6, **rest, **settings)
