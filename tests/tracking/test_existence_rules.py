"""Evidence that a track is a person, against the densities that it is made of."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tracking import TrackerConfig
from tracking._existence import confirming_logit, detection_logits, tentative_gap_s

CONFIG = TrackerConfig()


def test_a_detection_is_weighed_against_clutter() -> None:
    rng = np.random.default_rng(2)
    root = rng.uniform(-0.3, 0.3, (2, 20, 2, 2)) + 0.1 * np.eye(2)
    covariances, noises = root @ root.swapaxes(-1, -2)
    positions, measured = rng.uniform(-0.4, 0.4, (2, 20, 2))
    found = detection_logits(positions, covariances, measured, noises, CONFIG)
    # miss_cost says what a miss is worth: clutter of the density (1 − P_D)⁻¹ 2π exp(miss_cost / 2).
    for row in range(20):
        normal = multivariate_normal(positions[row], covariances[row] + noises[row])
        log_density = float(normal.logpdf(measured[row])) + math.log(2.0 * math.pi)
        expected = log_density + 0.5 * CONFIG.miss_cost
        expected += math.log(1.0 - CONFIG.detection_probability)
        assert found[row] == pytest.approx(expected)


def test_a_faster_camera_confirms_no_more_clutter_a_second() -> None:
    # Clutter confirms at most exp(−logit) of the tracks that it starts in each frame.
    false_per_s = [
        math.exp(-confirming_logit(period_s, CONFIG)) / period_s for period_s in (0.02, 0.2)
    ]
    assert false_per_s[0] == pytest.approx(false_per_s[1])
    assert confirming_logit(1.0, CONFIG) == CONFIG.confirm_logit


@pytest.mark.parametrize(("detected", "frames"), [(0.9, 2), (0.5, 7), (0.99, 1)])
def test_a_tentative_track_outlives_the_misses_of_all_but_one_in_a_hundred(
    detected: float, frames: int
) -> None:
    assert (1.0 - detected) ** frames <= 0.01 + 1e-9 < (1.0 - detected) ** (frames - 1)
    config = CONFIG.model_copy(update={"detection_probability": detected})
    assert tentative_gap_s(1.0, config) == pytest.approx(frames + 0.5)
    assert tentative_gap_s(0.001, config) == config.max_tentative_gap_s
    assert tentative_gap_s(math.inf, config) == config.max_tentative_gap_s
