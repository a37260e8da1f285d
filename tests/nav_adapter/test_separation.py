"""Speed and separation: published figures, the inverse, and motion in small steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import finite
from scipy.optimize import brentq

from nav_adapter import max_speed_mps, protective_separation_m

SETTINGS = {
    "deceleration_mps2": finite(0.2, 4.0),
    "reaction_time_s": finite(0.0, 1.5),
    "clearance_m": finite(0.0, 1.0),
}


def test_published_figures() -> None:
    limits = max_speed_mps(
        [1.0, 2.0, 3.0, 5.0], 1.6, deceleration_mps2=1.0, reaction_time_s=0.3, clearance_m=0.1
    )
    np.testing.assert_allclose(limits, [0.21, 0.64, 1.01, 1.63], atol=0.005)


def test_a_separation_too_small_for_a_float_gives_a_limit_of_0() -> None:
    limit = max_speed_mps(5e-324, 0.0, deceleration_mps2=0.25, reaction_time_s=0.0, clearance_m=0.0)
    assert limit == 0.0


@given(separation=finite(0.0, 30.0), human=finite(0.0, 3.0), **SETTINGS)
def test_speed_is_the_root_of_the_protective_separation(
    separation, human, deceleration_mps2, reaction_time_s, clearance_m
):
    settings = {
        "deceleration_mps2": deceleration_mps2,
        "reaction_time_s": reaction_time_s,
        "clearance_m": clearance_m,
    }

    def spare(speed: float) -> float:
        return separation - float(protective_separation_m(speed, human, **settings))

    speed = float(max_speed_mps(separation, human, **settings))
    if spare(0.0) <= 0.0:
        assert speed == 0.0
    else:
        assert speed == pytest.approx(brentq(spare, 0.0, 100.0, xtol=1e-13), abs=1e-9)


def test_the_limit_broadcasts_and_is_0_where_it_must_be() -> None:
    limits = max_speed_mps(
        np.array([[-1.0], [0.58], [np.nan], [4.0]]),
        np.array([1.6, 0.3]),
        deceleration_mps2=1.0,
        reaction_time_s=0.3,
        clearance_m=0.1,
    )
    assert limits.shape == (4, 2)
    assert limits[0].tolist() == [0.0, 0.0]
    assert limits[1, 0] == 0.0
    assert limits[1, 1] > 0.0
    assert limits[2].tolist() == [0.0, 0.0]
    assert (limits[3] > 0.0).all()
