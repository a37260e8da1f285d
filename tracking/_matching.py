"""Matching of a frame's measurements to the tracks, and the correction of the tracks by them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._association import Gates, Matches, Wide, associate
from ._clocks import FrameClock
from ._existence import detection_logits, with_evidence
from ._exits import floor_places
from ._fusion import wide_match
from ._kalman import correct
from ._measurement import Frame, Measurements
from ._sensors import Sensor, Sensors
from ._sizes import Sized, lasting_after, sized, without_lasting
from ._table import BoolArray, IndexArray, TrackTable
from ._track_management import record_hits
from ._twins import doubted, same_person

# How far a person may walk between two frames, in standard deviations of a new track's velocity.
_REACH_SIGMAS: Final = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A frame's measurements of N tracks.

    Attributes:
        source: (N,) the row of each track's measurement, −1 for none.
        ambiguous: (N,) True for matches that may be another person's.
        beyond: (N,) True for matches by the ray alone, whose range disagrees.
        rivals: (P, 2) as in :class:`~tracking._association.Matches`.
    """

    source: IndexArray
    ambiguous: BoolArray
    beyond: BoolArray
    rivals: IndexArray

    @property
    def seen(self) -> BoolArray:
        """(N,) True for tracks in the frame."""
        return self.source >= 0

    def with_births(self, measurements: IndexArray) -> Found:
        """Return the same with new tracks at these rows of measurements, which are certain."""
        certain = np.zeros(len(measurements), dtype=np.bool_)
        return Found(
            np.concatenate((self.source, measurements)),
            np.concatenate((self.ambiguous, certain)),
            np.concatenate((self.beyond, certain)),
            self.rivals,
        )


def match_frame(
    tracks: TrackTable,
    frame: Frame,
    dt_s: float,
    origin_m: tuple[float, float] | None,
    velocity_mps: tuple[float, float],
    clocks: tuple[FrameClock, ...],
    sensors: Sensors,
) -> tuple[TrackTable, Found, Frame]:
    """Match the frame's measurements to the tracks and correct the tracks with them.

    The frame is returned with its measurements as the matched tracks take them (``_sizes``).

    Args:
        tracks: N tracks, predicted to the frame.
        frame: its measurements.
        dt_s: since the frame before of the same sensor.
        origin_m: where the sensor without measured ranges stands or stood last; None if unknown.
        velocity_mps: of that sensor.
        clocks: of all sensors, this frame included.
        sensors: all sensors.
    """
    sensor, measured = sensors.all[frame.sensor], frame.measurements
    config, period_s = sensor.config, clocks[frame.sensor].period_s
    source = np.full(len(tracks), -1, dtype=np.intp)
    ambiguous = np.zeros(len(tracks), dtype=np.bool_)
    beyond = np.zeros(len(tracks), dtype=np.bool_)
    gates = sensor.gates
    if math.isfinite(period_s):
        reach_m = _REACH_SIGMAS * config.initial_velocity_std_mps * period_s
        if reach_m > gates.distance_m:
            gates = replace(gates, distance_m=reach_m)
    wide = wide_match(tracks, measured, origin_m, sensor, sensors, clocks, frame.stamp_s)
    sizes = sized(tracks, measured, origin_m)
    found = _matches(tracks, measured, gates, wide, sizes)
    rows, columns = found.tracks, found.measurements
    covariances = tracks.covariances[rows]
    if sizes is not None and origin_m is not None:
        covariances, frame = without_lasting(
            tracks, frame, sizes, rows, columns, velocity_mps, origin_m
        )
        measured = frame.measurements
    spreads = covariances[:, :2, :2]
    if wide is not None:
        spreads = spreads + found.wide[:, None, None] * wide.extra[rows, :2, :2]
    logits = detection_logits(
        tracks.states[rows, :2],
        spreads,
        measured.positions_odom_m[columns],
        measured.noises_m2[columns],
        config,
    )
    tracks = with_evidence(tracks, rows, logits, dt_s, config, frame.sensor)
    if not rows.size:
        return tracks, Found(source, ambiguous, beyond, found.rivals), frame
    source[rows], ambiguous[rows] = columns, found.ambiguous
    # An ambiguous measurement has less weight and leaves more uncertainty.
    factors = np.where(found.ambiguous, config.ambiguous_noise_factor, 1.0)
    noises = measured.noises_m2[columns] * factors[:, None, None]
    if wide is not None:
        beyond[rows] = found.wide
        covariances, noises = _without_assumed_range(covariances, noises, wide, rows, sensor)
        if sensor.settings.measures_range:
            # A place that jumps along the ray may be another person's.
            ambiguous |= beyond
    if sizes is not None and origin_m is not None:
        lasting = lasting_after(tracks, sizes, rows, columns, covariances, noises, origin_m)
        tracks = tracks.replaced(lasting_stds=lasting)
    states, new_covariances = tracks.states.copy(), tracks.covariances.copy()
    states[rows], new_covariances[rows] = correct(
        states[rows], covariances, measured.positions_odom_m[columns], noises
    )
    tracks = tracks.replaced(states=states, covariances=new_covariances)
    if frame.sensor == 0:
        places = tracks.last_places_camera_m.copy()
        places[rows] = floor_places(states[rows, :2], frame.T_odom_camera)
        tracks = tracks.replaced(last_places_camera_m=places)
    tracks = record_hits(tracks, rows, frame.stamp_s, period_s, config, frame.sensor)
    return tracks, Found(source, ambiguous, beyond, found.rivals), frame


def _without_assumed_range(
    covariances: FloatArray, noises_m2: FloatArray, wide: Wide, rows: IndexArray, sensor: Sensor
) -> tuple[FloatArray, FloatArray]:
    """Return the covariances (K, 4, 4) of tracks and the noises (K, 2, 2) of their measurements.

    Whichever of the two has a range that follows from an assumed size leaves it to the other.
    """
    if sensor.settings.measures_range:
        return covariances + wide.extra[rows], noises_m2
    return covariances, noises_m2 + wide.extra[rows, :2, :2]


def _matches(
    tracks: TrackTable,
    measured: Measurements,
    gates: Gates,
    wide: Wide | None,
    sizes: Sized | None,
) -> Matches:
    """Return the matches of a frame.

    Weak detections are offered to the confirmed tracks that are left without a match, as in
    ByteTrack (Zhang et al., ECCV 2022).
    """
    first, people = tracks.confirmed & ~doubted(tracks), same_person(tracks)
    positions, covariances = tracks.states[:, :2], tracks.covariances[:, :2, :2]
    places, noises = measured.positions_odom_m, measured.noises_m2
    if not measured.weak.any():
        return associate(positions, covariances, first, places, noises, gates, people, wide, sizes)
    offered = np.flatnonzero(~measured.weak)
    everybody = np.arange(len(tracks))
    found = associate(
        positions,
        covariances,
        first,
        places[offered],
        noises[offered],
        gates,
        people,
        None if wide is None else wide.part(everybody, offered),
        None if sizes is None else sizes.part(everybody, offered),
    )
    columns = offered[found.measurements]
    left = tracks.confirmed.copy()
    left[found.tracks] = False
    rest, offered = np.flatnonzero(left), np.flatnonzero(measured.weak)
    second = associate(
        positions[rest],
        covariances[rest],
        first[rest],
        places[offered],
        noises[offered],
        gates,
        None if people is None else people[rest],
        None if wide is None else wide.part(rest, offered),
        None if sizes is None else sizes.part(rest, offered),
    )
    return Matches(
        np.concatenate((found.tracks, rest[second.tracks])),
        np.concatenate((columns, offered[second.measurements])),
        np.concatenate((found.ambiguous, second.ambiguous)),
        np.concatenate((found.wide, second.wide)),
        np.concatenate((found.rivals, np.where(second.rivals < 0, -1, rest[second.rivals]))),
    )
