"""The reach of people: closed forms against integration of their motion, and recorded people."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nav_adapter.reach import Reach, Spread

SPEEDS = st.floats(0.0, 2.0)
TIMES = st.floats(0.0, 3.0)


def person(u: tuple[float, float] = (0.0, 0.0), top: float = 1.5, **changes: float) -> Reach:
    return Reach(0.0, 0.0, *u, top, 0.54, 0.15)._replace(**changes)


@given(walk=SPEEDS, top=SPEEDS, ahead=TIMES, seed=st.integers(0, 999))
def test_people_who_change_their_velocity_stay_within_reach(walk, top, ahead, seed) -> None:
    rng = np.random.default_rng(seed)
    reach = person((walk, 0.0), top)
    tau, delay = reach.time_constant_s, reach.delay_s
    # Since before anybody could notice, towards targets that change at random.
    edges = np.sort(np.append(rng.uniform(-delay, ahead, 4), [-delay, ahead]))
    added, added_mps = np.zeros(2), np.zeros(2)
    for start, end in pairwise(edges):
        angle = rng.uniform(-math.pi, math.pi)
        target = top * rng.uniform(0.0, 1.0) ** 0.2 * np.array([math.cos(angle), math.sin(angle)])
        decay = math.exp(-(end - start) / tau)
        added += target * (end - start) + (added_mps - target) * tau * (1.0 - decay)
        added_mps = target + (added_mps - target) * decay
    # The middle carries the motion that the track showed, which dies away.
    seen = walk * tau * (1.0 - math.exp(-ahead / tau))
    assert reach.drift_s(ahead) * walk == pytest.approx(seen, abs=1e-12)
    assert np.linalg.norm(added) <= reach.radius_m(ahead) + 1e-9


@given(until=TIMES, aware=st.floats(0.0, 1.0), ahead=TIMES)
def test_who_forgets_the_robot_sets_off_then(until: float, aware: float, ahead: float) -> None:
    reach = person(top=aware, until_s=until, later_mps=1.5, within_m=0.05)
    since = ahead + reach.delay_s
    times = np.linspace(0.0, since, 4001)
    # The same direction all the time, at the speed that is wanted; the body follows by τ.
    wanted = np.where(times < until, aware, 1.5)
    lag = np.exp(-(since - times) / reach.time_constant_s)
    integrand = wanted * (1.0 - lag)
    way = float(np.sum(0.5 * (integrand[1:] + integrand[:-1]) * np.diff(times)))
    assert reach.radius_m(ahead) == pytest.approx(way, abs=2e-3)
    unaware = person(top=1.5)
    assert aware * since - 1e-9 <= reach.radius_m(ahead) + aware * reach.time_constant_s
    assert reach.radius_m(ahead) <= unaware.radius_m(ahead) + 1e-9
    gone = reach.radius_m(ahead) + reach.margin_after_m(ahead)
    assert gone <= unaware.radius_m(ahead) + unaware.margin_after_m(ahead) + 1e-9
    assert gone <= reach.radius_m(ahead + 0.1) + reach.margin_after_m(ahead + 0.1) + 1e-9


def test_the_reach_holds_what_recorded_people_did() -> None:
    # 229 people who stood within 4 m of a mobile robot, 99th percentile (docs/people.md).
    recorded = {0.5: 0.28, 1.0: 0.60, 1.5: 1.00, 2.0: 1.46}
    assert all(person(top=1.05).radius_m(t) >= way - 0.005 for t, way in recorded.items())
    assert all(person(top=1.5).radius_m(t) > way for t, way in recorded.items())


@given(ahead=TIMES, age=st.floats(0.0, 1.0))
def test_an_old_place_is_as_far_ahead_in_time(ahead: float, age: float) -> None:
    now, old = person((1.0, 0.5)), person((1.0, 0.5), elapsed_s=age)
    assert old.radius_m(ahead) == pytest.approx(now.radius_m(ahead + age), abs=1e-12)
    assert old.drift_s(ahead) == pytest.approx(now.drift_s(ahead + age), abs=1e-12)


@given(seed=st.integers(0, 999), drift=st.floats(0.0, 0.6), sigmas=st.floats(0.0, 3.0))
def test_the_uncertainty_covers_place_and_velocity(seed: int, drift: float, sigmas: float) -> None:
    root = np.random.default_rng(seed).normal(0.0, 0.2, (4, 4))
    covariance = root @ root.T
    F = np.array([[1.0, 0.0, drift, 0.0], [0.0, 1.0, 0.0, drift]])
    largest = float(np.linalg.eigvalsh(F @ covariance @ F.T)[-1])
    terms = Spread.of(covariance.tolist()).terms(sigmas)
    found = person(variances=terms).uncertainty_m(drift)
    assert found >= sigmas * math.sqrt(largest) - 1e-9
    assert person(variances=terms).uncertainty_m(0.0) == pytest.approx(
        sigmas * math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1])), abs=1e-9
    )


@given(seed=st.integers(0, 999), ahead=st.floats(-1.0, 3.0))
def test_a_spread_that_drifts_is_that_of_the_predicted_track(seed: int, ahead: float) -> None:
    root = np.random.default_rng(seed).normal(0.0, 0.2, (4, 4))
    F = np.eye(4) + ahead * np.eye(4, k=2)
    predicted = F @ root @ root.T @ F.T
    drifted = Spread.of((root @ root.T).tolist()).after(ahead)
    np.testing.assert_allclose(drifted, Spread.of(predicted.tolist()), atol=1e-9)
    largest = float(np.linalg.eigvalsh(predicted[:2, :2])[-1])
    assert drifted.sigma_m == pytest.approx(math.sqrt(largest), abs=1e-9)
