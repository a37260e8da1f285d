"""The peer Stone Soup: global nearest neighbour, and joint probabilistic data association."""

from __future__ import annotations

import datetime
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._contender import MAX_UNSEEN_S
from ._judges import TrackedFrame
from ._measurements import SimulatedRecording

_BEGIN = datetime.datetime(2024, 1, 1)


@dataclass(frozen=True, slots=True)
class StoneSoupSettings:
    """Common settings, with the sensor's true figures where Stone Soup asks for them.

    Attributes:
        gate_sigma: largest Mahalanobis distance between a measurement and its track (GNN).
        gate_probability: the gate as a probability (JPDA).
        acceleration_density_m2ps3: of the white acceleration.
        velocity_std_mps: of a new track.
        confirm_hits: measurements that confirm a track (of the initiator).
        max_unseen_s: time after which an unseen track is dropped.
    """

    gate_sigma: float = 3.4
    gate_probability: float = 0.997
    acceleration_density_m2ps3: float = 0.1
    velocity_std_mps: float = 1.0
    confirm_hits: int = 3
    max_unseen_s: float = MAX_UNSEEN_S


class StoneSoup(ABC):
    """A Stone Soup multi-target tracker on precomputed sets of detections."""

    name = "stonesoup"

    def __init__(self, settings: StoneSoupSettings | None = None) -> None:
        self._settings = settings or StoneSoupSettings()

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        from stonesoup.dataassociator.neighbour import GNNWith2DAssignment  # noqa: PLC0415
        from stonesoup.deleter.time import UpdateTimeStepsDeleter  # noqa: PLC0415
        from stonesoup.hypothesiser.distance import DistanceHypothesiser  # noqa: PLC0415
        from stonesoup.initiator.simple import MultiMeasurementInitiator  # noqa: PLC0415
        from stonesoup.measures import Mahalanobis  # noqa: PLC0415
        from stonesoup.models.measurement.linear import LinearGaussian  # noqa: PLC0415
        from stonesoup.models.transition.linear import (  # noqa: PLC0415
            CombinedLinearGaussianTransitionModel,
            ConstantVelocity,
        )
        from stonesoup.predictor.kalman import KalmanPredictor  # noqa: PLC0415
        from stonesoup.types.detection import Detection  # noqa: PLC0415
        from stonesoup.types.state import GaussianState  # noqa: PLC0415
        from stonesoup.updater.kalman import KalmanUpdater  # noqa: PLC0415

        settings, dt_s = self._settings, float(np.diff(recording.stamps_s).mean())
        model = LinearGaussian(
            ndim_state=4, mapping=(0, 2), noise_covar=recording.noise_std_m**2 * np.eye(2)
        )
        predictor = KalmanPredictor(
            CombinedLinearGaussianTransitionModel(
                [ConstantVelocity(settings.acceleration_density_m2ps3)] * 2
            )
        )
        updater = KalmanUpdater(model)
        nearest = GNNWith2DAssignment(
            DistanceHypothesiser(
                predictor, updater, Mahalanobis(), missed_distance=settings.gate_sigma
            )
        )
        initiator = MultiMeasurementInitiator(
            prior_state=GaussianState(
                np.zeros((4, 1)), np.diag([0.0, settings.velocity_std_mps**2] * 2)
            ),
            measurement_model=model,
            deleter=UpdateTimeStepsDeleter(2),
            data_associator=nearest,
            updater=updater,
            min_points=settings.confirm_hits,
        )
        frames = [
            (
                _BEGIN + datetime.timedelta(seconds=float(stamp_s)),
                {
                    Detection(
                        point[:, None],
                        timestamp=_BEGIN + datetime.timedelta(seconds=float(stamp_s)),
                        measurement_model=model,
                    )
                    for point in measured
                },
            )
            for stamp_s, measured in zip(recording.stamps_s, recording.measured_m, strict=True)
        ]
        deleter = UpdateTimeStepsDeleter(round(settings.max_unseen_s / dt_s))
        self._tracks = iter(
            self._tracker(
                {
                    "initiator": initiator,
                    "deleter": deleter,
                    "detector": frames,
                    "updater": updater,
                },
                nearest,
                predictor,
                recording,
            )
        )
        self._ids: dict[str, int] = {}

    @abstractmethod
    def _tracker(
        self, parts: dict[str, Any], nearest: Any, predictor: Any, recording: SimulatedRecording
    ) -> Any:
        """Return the tracker made of these parts."""

    def make(self, frame: int) -> None:  # noqa: B027 - no detections to make
        """Do nothing: the measurements are taken as they are, or were converted at the start."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        return next(self._tracks)[1]

    def report(self, result: Any) -> TrackedFrame:
        """Return the confirmed tracks, which have left the initiator."""
        tracks = list(result)
        return TrackedFrame(
            np.array([self._ids.setdefault(t.id, len(self._ids)) for t in tracks], dtype=np.int64),
            np.array([t.state.mean[[0, 2], 0] for t in tracks], dtype=float).reshape(-1, 2),
        )


class StoneSoupGnn(StoneSoup):
    """Stone Soup with global nearest neighbour by the Mahalanobis distance."""

    name = "stonesoup-gnn"

    def _tracker(
        self, parts: dict[str, Any], nearest: Any, predictor: Any, recording: SimulatedRecording
    ) -> Any:
        from stonesoup.tracker.simple import MultiTargetTracker  # noqa: PLC0415

        return MultiTargetTracker(data_associator=nearest, **parts)


class StoneSoupJpda(StoneSoup):
    """Stone Soup with joint probabilistic data association by loopy belief propagation.

    Stone Soup's plain ``JPDA`` enumerates joint events, which is not feasible for 20 people.
    """

    name = "stonesoup-jpda"

    def _tracker(
        self, parts: dict[str, Any], nearest: Any, predictor: Any, recording: SimulatedRecording
    ) -> Any:
        from stonesoup.dataassociator.probability import JPDAwithLBP  # noqa: PLC0415
        from stonesoup.hypothesiser.probability import PDAHypothesiser  # noqa: PLC0415
        from stonesoup.tracker.simple import MultiTargetMixtureTracker  # noqa: PLC0415

        hypothesiser = PDAHypothesiser(
            predictor,
            parts["updater"],
            clutter_spatial_density=max(recording.clutter_per_m2, 1e-4),
            prob_detect=1.0 - recording.miss_probability,
            prob_gate=self._settings.gate_probability,
        )
        return MultiTargetMixtureTracker(data_associator=JPDAwithLBP(hypothesiser), **parts)
