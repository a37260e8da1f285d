"""Uncertainty of a predicted position along its most uncertain direction."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import larger_eigenvalue
from tracking import PersonTrack
from tracking.prediction import PredictionModel, predict_ahead


def predicted_sigmas_m(
    track: PersonTrack, horizons_s: FloatArray, model: PredictionModel
) -> FloatArray:
    """Return standard deviations (T,) at times (T,) ≥ 0 after the track's stamp."""
    return largest_sigmas_m(predict_ahead(track, horizons_s, model).covariances_odom_m2[0])


def largest_sigmas_m(covariances_m2: FloatArray) -> FloatArray:
    """Return standard deviations (...) of positions (..., 2, 2), in their most uncertain way."""
    xx, xy, yy = (covariances_m2[..., row, column] for row, column in ((0, 0), (0, 1), (1, 1)))
    return np.asarray(np.sqrt(larger_eigenvalue(xx, xy, yy)))
