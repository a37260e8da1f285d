"""Figures of how sure head poses are: axis NEES against Monte Carlo, and a run on renders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.perception._pictures import CONDITIONS
from benchmarks.perception._sureness import axis_nees, measure
from perception import HeadPose


def _pose(rotation: np.ndarray, covariance: np.ndarray) -> HeadPose:
    full = np.eye(6) * 1e-4
    full[:3, :3] = covariance
    return HeadPose(np.array([0.0, 0.0, 3.0]), rotation, full, 0.5)


def test_errors_with_the_stated_covariance_have_a_nees_of_two():
    rng = np.random.default_rng(3)
    factor = np.array([[0.09, 0.0, 0.0], [0.03, 0.05, 0.0], [-0.02, 0.01, 0.07]])
    nees, sigmas = [], []
    for _ in range(4000):
        rotation = Rotation.random(random_state=rng).as_matrix()
        true = Rotation.from_rotvec(factor @ rng.normal(size=3)).as_matrix() @ rotation
        value, sigma = axis_nees(_pose(rotation, factor @ factor.T), true[:, 1])
        nees.append(value)
        sigmas.append(sigma)
    # The mean of 4000 values with variance 4 has a standard deviation of 0.03.
    assert np.mean(nees) == pytest.approx(2.0, abs=0.13)
    assert np.mean(np.array(nees) < 5.991) == pytest.approx(0.95, abs=0.012)
    assert 0.03 < min(sigmas) < max(sigmas) < 0.1


def test_a_turn_about_the_axis_itself_is_no_error_of_the_axis():
    rotation = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix()
    rolled = rotation @ Rotation.from_rotvec([0.0, 0.7, 0.0]).as_matrix()
    nees, sigma = axis_nees(_pose(rotation, np.eye(3) * 0.01), rolled[:, 1])
    assert nees == pytest.approx(0.0, abs=1e-12)
    assert sigma == pytest.approx(0.1)
    turned = rotation @ Rotation.from_rotvec([0.2, 0.0, 0.0]).as_matrix()
    assert axis_nees(_pose(rotation, np.eye(3) * 0.01), turned[:, 1])[0] == pytest.approx(4.0)


@pytest.mark.full
def test_heads_of_renders_are_judged_by_condition():
    conditions = [each for each in CONDITIONS if each.name in ("clean", "5–10 m")]
    groups = measure(conditions, 3, 11)
    assert list(groups) == ["clean", "5–10 m", "faces under 20 px"]
    far, small = groups["5–10 m"], groups["faces under 20 px"]
    assert len(groups["clean"].nees) >= 2
    # All faces beyond 5 m are small.
    assert len(small.nees) >= len(far.nees) >= 2
    assert all(value > 0.0 for group in groups.values() for value in group.sigma_deg)
