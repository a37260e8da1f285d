"""filterpy's IMM estimator as a predictor: three ways of walking, mixed by their likelihoods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from filterpy.kalman import IMMEstimator, KalmanFilter

from ._prediction_sets import HORIZONS_S, MeasuredWalk, judged_frames
from ._walkers import FloatArray


@dataclass(frozen=True, slots=True)
class ImmSettings:
    """Settings of the estimator, tuned on the sets that the model was fitted to.

    Attributes:
        steady_m2ps3: q of the white acceleration of people who walk straight on.
        turning_m2ps3: the same of people who turn, stop or set off.
        stopping_s: time constant of the velocity of people who stop, with the second q.
        stay_s: mean time in one mode.
    """

    steady_m2ps3: float = 0.03
    turning_m2ps3: float = 0.1
    stopping_s: float = 2.0
    stay_s: float = 2.0


class _Mode(NamedTuple):
    filter: KalmanFilter
    density_m2ps3: float
    decay_s: float

    def set_step(self, dt_s: float) -> None:
        """Set transition and noise of the filter to a step."""
        F, Q = np.eye(4), np.zeros((4, 4))
        left = math.exp(-dt_s / self.decay_s)
        F[:2, 2:] = (self.decay_s * (1.0 - left) if self.decay_s < 1e6 else dt_s) * np.eye(2)
        F[2:, 2:] = left * np.eye(2)
        block = np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
        Q[:] = self.density_m2ps3 * np.kron(block, np.eye(2))
        self.filter.F, self.filter.Q = F, Q


def predict_by_imm(
    walks: Sequence[MeasuredWalk], settings: ImmSettings | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return means (K, T, 2), covariances (K, T, 2, 2) and true places (K, T, 2)."""
    settings = settings or ImmSettings()
    means: list[FloatArray] = []
    covariances: list[FloatArray] = []
    later: list[FloatArray] = []
    for each in walks:
        _follow(each, settings, means, covariances, later)
    return np.array(means), np.array(covariances), np.array(later)


def _follow(
    each: MeasuredWalk,
    settings: ImmSettings,
    means: list[FloatArray],
    covariances: list[FloatArray],
    later: list[FloatArray],
) -> None:
    dt_s = float(each.stamps_s[1])
    first = int(np.flatnonzero(np.isfinite(each.measured_m[:, 0]))[0])
    modes = [
        _mode(each, first, settings.steady_m2ps3, 1e9),
        _mode(each, first, settings.turning_m2ps3, 1e9),
        _mode(each, first, settings.turning_m2ps3, settings.stopping_s),
    ]
    stay = math.exp(-dt_s / settings.stay_s)
    change = np.full((3, 3), 0.5 * (1.0 - stay)) + (stay - 0.5 * (1.0 - stay)) * np.eye(3)
    imm = IMMEstimator([mode.filter for mode in modes], np.array([0.6, 0.2, 0.2]), change)
    judged = set(judged_frames(each))
    for frame in range(first + 1, len(each.stamps_s)):
        for mode in modes:
            mode.set_step(dt_s)
        imm.predict()
        if np.isfinite(each.measured_m[frame, 0]):
            imm.update(each.measured_m[frame])
        stamp_s = float(each.stamps_s[frame])
        if frame in judged and stamp_s + HORIZONS_S[0] <= each.truth_s[-1]:
            places = [_ahead(imm, modes, horizon_s) for horizon_s in HORIZONS_S.tolist()]
            means.append(np.array([mean for mean, _ in places]))
            covariances.append(np.array([covariance for _, covariance in places]))
            later.append(each.places_m(stamp_s + HORIZONS_S))


def _mode(each: MeasuredWalk, first: int, density_m2ps3: float, decay_s: float) -> _Mode:
    made = KalmanFilter(dim_x=4, dim_z=2)
    made.x = np.array([*each.measured_m[first], 0.0, 0.0])
    made.P = np.diag([each.noise_std_m**2] * 2 + [1.0, 1.0])
    made.H = np.eye(2, 4)
    made.R = each.noise_std_m**2 * np.eye(2)
    return _Mode(made, density_m2ps3, decay_s)


def _ahead(imm: Any, modes: Sequence[_Mode], horizon_s: float) -> tuple[FloatArray, FloatArray]:
    """Return the mixed place and its covariance one long step ahead; the estimator stays as is."""
    kept = [(mode.filter.x.copy(), mode.filter.P.copy()) for mode in modes]
    mixed = imm.x.copy(), imm.P.copy()
    for mode in modes:
        mode.set_step(horizon_s)
    imm.predict()
    found = imm.x[:2].copy(), imm.P[:2, :2].copy()
    for mode, (x, P) in zip(modes, kept, strict=True):
        mode.filter.x, mode.filter.P = x, P
    imm.x, imm.P = mixed
    return found
