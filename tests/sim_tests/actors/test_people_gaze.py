"""Glances: their statistics against closed forms, and the motion of head and eyes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from sim_tests import SimError
from sim_tests.actors.behaviour import Glances, RobotBody
from sim_tests.actors.behaviour._gaze import Gaze, LogNormalDuration

GLANCE = LogNormalDuration.fitted(0.83, (0.47, 1.50))
AWAY = LogNormalDuration.fitted(1.03, (0.63, 1.98))
#: Share of pedestrians who had looked within the last 0.5, 1, 2, 3 s before crossing.
OBSERVED = {0.5: 0.41, 1.0: 0.54, 2.0: 0.75, 3.0: 0.82}


def survival(length: LogNormalDuration, t_s: float) -> float:
    return float(norm.sf(math.log(t_s / length.median_s) / length.sigma)) if t_s > 0.0 else 1.0


def looked_within(tau_s: float) -> float:
    """Return the probability of a look within the last ``tau_s`` of a stationary process.

    The person looks now, or has looked away for less than ``tau_s``.
    """
    recent, _ = quad(lambda age: survival(AWAY, age), 0.0, tau_s)
    return (GLANCE.mean_s + recent) / (GLANCE.mean_s + AWAY.mean_s)


@pytest.mark.parametrize("length", [GLANCE, AWAY])
def test_drawn_durations_have_the_fitted_median_mean_and_quartile_ratio(length):
    rng = np.random.default_rng(1)
    drawn = np.array([length.draw_s(rng) for _ in range(20_000)])
    lower, median, upper = np.quantile(drawn, (0.25, 0.5, 0.75))
    assert median == pytest.approx(length.median_s, rel=0.03)
    assert math.log(upper / lower) == pytest.approx(2.0 * norm.ppf(0.75) * length.sigma, rel=0.04)
    assert drawn.mean() == pytest.approx(length.mean_s, rel=0.05)


def test_the_stated_share_of_lookers_fits_the_data_best():
    process = np.array([looked_within(tau_s) for tau_s in OBSERVED])
    data = np.array(list(OBSERVED.values()))
    share = float(data @ process / (process @ process))
    assert share == pytest.approx(0.81, abs=0.005)
    np.testing.assert_allclose(share * process, [0.50, 0.60, 0.70, 0.75], atol=0.006)
    assert np.sqrt(np.mean((share * process - data) ** 2)) < 0.08
    assert np.sqrt(np.mean((process - data) ** 2)) > 0.15


def robot_at(x: float, y: float, height_m: float = 1.4) -> RobotBody:
    return RobotBody(x, y, 0.0, 0.0, 0.0, 0.36, 0.25, (x, y, height_m))


def watch(gaze: Gaze, path, seconds: float, sees=lambda t: True, dt_s: float = 0.05):
    """Return rows t, head yaw and pitch, eye yaw and pitch, looking of a person at the origin."""
    rows = []
    for n in range(round(seconds / dt_s)):
        t = n * dt_s
        robot = path(t)
        seen = gaze.in_field_of_view(dt_s, (0.0, 0.0, 0.0), robot) and sees(t)
        gaze.update(t, dt_s, (0.0, 0.0, 0.0), robot, seen)
        rows.append((t, *gaze.angles(dt_s), gaze.looking))
    return np.array(rows)


def test_the_head_turns_smoothly_through_the_front_and_the_eyes_lead():
    """A robot that passes behind a person is lost on one side and found on the other."""
    gaze = Gaze(Glances(watches=True, notices_within_m=20.0), 1.75, np.random.default_rng(0))

    def around(t: float) -> RobotBody:
        angle = min(1.2 + 0.8 * t, 2.0 * math.pi - 1.2)  # from the left, behind, to the right
        return robot_at(4.0 * math.cos(angle), 4.0 * math.sin(angle))

    rows = watch(gaze, around, 8.0)
    t, yaw, eyes = rows[:, 0], rows[:, 1], rows[:, 3]
    rate = np.diff(yaw) / np.diff(t)
    assert np.abs(rate).max() <= 3.2 + 1e-6
    assert np.abs(np.diff(rate)).max() <= 25.0 * 0.05 + 1e-6
    assert np.abs(yaw).max() <= math.radians(80.0) + 1e-9
    assert np.abs(eyes).max() <= math.radians(35.0) + 1e-9
    # First to the left limit, at the end to the right; never through the back.
    assert yaw.max() > 1.35
    assert yaw[-1] == pytest.approx(-1.2, abs=0.05)
    assert np.abs(np.diff(yaw)).max() < 0.2
    assert (eyes[5:12] > 0.2).any()
    assert np.abs(eyes[-5:]).max() < 0.02


def test_a_robot_behind_hidden_or_far_away_is_not_noticed():
    def noticed(where, sees=lambda t: True, **glances):
        gaze = Gaze(Glances(watches=True, **glances), 1.75, np.random.default_rng(0))
        watch(gaze, lambda t: robot_at(*where), 6.0, sees)
        return gaze.noticed_s

    assert noticed((-3.0, 0.5)) is None
    assert noticed((3.0, 0.0), lambda t: False) is None
    assert noticed((13.0, 0.0)) is None
    assert noticed((3.0, 0.0), notices_within_m=0.0) is None
    assert noticed((3.0, 0.0), looker_share=0.0) is None
    # The field of view turns with the head, not with the body.
    assert noticed((0.0, -3.0), away_yaw_deg=80.0) is None
    assert noticed((0.0, -3.0)) is not None
    assert noticed((3.0, 0.0), lambda t: t > 2.0) == pytest.approx(2.3, abs=0.2)
    assert noticed((3.0, 0.0), first_glance_delay_s=1.5) == pytest.approx(1.5, abs=0.2)


def test_glances_alternate_and_stop_for_good_after_giving_up():
    def looks(**glances) -> np.ndarray:
        gaze = Gaze(Glances(**glances), 1.75, np.random.default_rng(4))
        return watch(gaze, lambda t: robot_at(5.0, 1.0), 40.0)[:, 5]

    looking = looks()
    assert 0.2 < looking[100:].mean() < 0.7
    assert np.count_nonzero(np.diff(looking)) > 10
    assert looks(watches=True)[20:].all()
    ended = looks(watches=True, gives_up_after_s=3.0)
    assert ended[20:60].all()
    assert not ended[70:].any()


def test_quartiles_must_lie_on_either_side_of_the_median():
    with pytest.raises(SimError, match="either side of the median"):
        LogNormalDuration.fitted(1.0, (1.2, 2.0))
    with pytest.raises(ValueError, match="glance_quartiles_s"):
        Glances(glance_median_s=2.0)
