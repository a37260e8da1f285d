"""SimCC outputs: peaks between bins, depths and confidences, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from perception.networks.poses import simcc_confidence, simcc_depth_m, simcc_peaks


def gaussian(place: float, bins: int, sigma: float = 6.0, height: float = 0.8) -> np.ndarray:
    reach = np.arange(bins) - place
    return (height * np.exp(-0.5 * (reach / sigma) ** 2)).astype(np.float32).reshape(1, 1, bins)


@example(1.5, 1.0, 3.0)  # midway between two bins, where rounding decides which is higher
@given(st.floats(1.0, 286.0), st.floats(1.0, 12.0), st.floats(0.05, 20.0))
def test_the_position_of_a_gaussian_is_exact(place: float, sigma: float, height: float) -> None:
    places, heights = simcc_peaks([gaussian(place, 288, sigma, height)])
    assert places[0, 0, 0] == pytest.approx(place, abs=2e-3)
    assert heights[0, 0, 0] <= height * (1 + 1e-6)
    assert heights[0, 0, 0] >= height * np.exp(-0.5 * (0.5 / sigma) ** 2) * (1 - 1e-5)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("end", [0, 63])
def test_a_peak_at_the_end_of_an_axis_stays_there(end: int, dtype: type) -> None:
    places, heights = simcc_peaks([gaussian(end, 64).astype(dtype)])
    assert places[0, 0, 0] == end
    assert heights[0, 0, 0] == pytest.approx(0.8, rel=1e-3)


@pytest.mark.parametrize("rows", [np.zeros((2, 3, 9)), np.full((2, 3, 9), -2.0)])
def test_a_constant_row_has_a_position_and_causes_no_warning(rows: np.ndarray) -> None:
    places, heights = simcc_peaks([rows])
    assert ((places >= 0) & (places <= 8)).all()
    np.testing.assert_array_equal(heights[0], rows[..., 0])


@pytest.mark.parametrize("invalid", [np.nan, np.inf])
def test_a_row_that_is_not_finite_has_height_0_and_does_not_affect_others(invalid: float) -> None:
    rows = np.concatenate([gaussian(20.3, 64), gaussian(30.6, 64)], axis=1)
    rows[0, 0, 50] = invalid
    places, heights = simcc_peaks([rows])
    assert (places[0, 0, 0], heights[0, 0, 0]) == (0.0, 0.0)
    assert places[0, 0, 1] == pytest.approx(30.6, abs=1e-3)


def test_axes_of_different_lengths_are_read_together() -> None:
    axes = [gaussian(20.3, 64), gaussian(100.7, 128, height=0.5), gaussian(7.5, 32)]
    places, heights = simcc_peaks(axes)
    np.testing.assert_allclose(places[:, 0, 0], [20.3, 100.7, 7.5], atol=1e-3)
    # The confidence is that of the weaker of x and y.
    assert simcc_confidence(heights, np.array([[True]]))[0, 0] == pytest.approx(0.5, rel=0.02)
    assert simcc_confidence(heights, np.array([[False]]))[0, 0] == 0.0


def test_the_height_along_z_is_no_part_of_the_confidence() -> None:
    """OpenMMLab's ``get_simcc_maximum`` masks x with y, and takes only the place along z."""
    heights = np.array([[[0.9, 0.2]], [[0.8, 0.7]], [[0.1, 0.1]]])
    np.testing.assert_array_equal(simcc_confidence(heights, np.ones((1, 2), bool)), [[0.8, 0.2]])


@given(st.floats(0, 576))
def test_the_depth_follows_rtmw3ds_formula(place: float) -> None:
    wanted = (place / 2 / 144 - 1) * 2.1744869
    assert simcc_depth_m(np.array([[place]]), 576)[0, 0] == pytest.approx(wanted, abs=1e-12)
