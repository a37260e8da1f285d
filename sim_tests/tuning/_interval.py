"""Stand-in for measures._statistics until that is merged."""

from __future__ import annotations

import numpy as np


def bootstrap_interval(values, rng, level=0.95):
    values = np.asarray(values, dtype=float)
    means = values[rng.integers(0, len(values), (4000, len(values)))].mean(axis=1)
    return float(np.quantile(means, 0.5 - level / 2)), float(np.quantile(means, 0.5 + level / 2))
