from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import white_acceleration

from tracking._measurement import floor_covariances
from tracking._motion import process_noise, transition

steps = st.floats(1e-3, 5.0)
densities = st.floats(1e-3, 10.0)


@pytest.mark.parametrize("dt_s", [0.01, 0.05, 0.4, 3.0])
def test_motion_solves_the_stochastic_differential_equation(dt_s: float) -> None:
    F, Q = white_acceleration(dt_s, 0.05)
    np.testing.assert_allclose(transition(dt_s), F, atol=1e-12)
    np.testing.assert_allclose(process_noise(dt_s, 0.05), Q, atol=1e-12)


@given(first=steps, second=steps, q=densities)
def test_two_steps_are_one(first: float, second: float, q: float) -> None:
    F2 = transition(second)
    np.testing.assert_allclose(F2 @ transition(first), transition(first + second), atol=1e-12)
    np.testing.assert_allclose(
        F2 @ process_noise(first, q) @ F2.T + process_noise(second, q),
        process_noise(first + second, q),
        rtol=1e-9,
        atol=1e-15,
    )


def test_no_time_changes_nothing() -> None:
    np.testing.assert_array_equal(transition(0.0), np.eye(4))
    np.testing.assert_array_equal(process_noise(0.0, 0.05), np.zeros((4, 4)))


@given(
    low=st.floats(0.0, 1.0),
    extra=st.floats(0.0, 1.0),
    angle=st.floats(-np.pi, np.pi),
    floor_m=st.floats(0.01, 1.0),
)
def test_the_noise_floor_raises_eigenvalues_and_keeps_directions(
    low: float, extra: float, angle: float, floor_m: float
) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    eigenvalues = np.array([low, low + extra])
    (floored,) = floor_covariances((turn @ np.diag(eigenvalues) @ turn.T)[None], floor_m)
    expected = turn @ np.diag(np.maximum(eigenvalues, floor_m**2)) @ turn.T
    np.testing.assert_allclose(floored, expected, atol=1e-9)
