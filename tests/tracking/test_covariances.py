"""Covariances ahead against the matrices that they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from tracking_scenes import white_acceleration

from tracking.covariances import drifted, matrices


@pytest.mark.parametrize("seed", range(20))
def test_a_covariance_ahead_is_that_of_constant_velocity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    roots = rng.normal(size=(2, 4, 4))
    given = roots @ roots.transpose(0, 2, 1)
    ahead_s = [0.0, float(rng.uniform(0.0, 3.0))]
    uppers = [tuple(P[np.triu_indices(4)].tolist()) for P in given]
    found = matrices([drifted(upper, dt_s) for upper, dt_s in zip(uppers, ahead_s, strict=True)])
    F, _ = white_acceleration(ahead_s[1], 1.0)
    np.testing.assert_allclose(found, [given[0], F @ given[1] @ F.T], rtol=1e-12, atol=1e-12)
