"""Conversion of a tracker's state to plain JSON values and back, without loss of a bit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from perception.arrays import FloatArray, covariance_matrix, rigid_transform

from ._admission import Admission, Leap
from ._clocks import FrameClock
from ._config import TrackerConfig
from ._errors import TrackingError
from ._exits import Exits
from ._history import History
from ._measurement import Frame, Measurements
from ._saved_records import (
    FORMAT,
    VERSION,
    FrameClockRecord,
    FrameRecord,
    HistoryRecord,
    JumpedClockRecord,
    StateRecord,
    TrackerRecord,
)
from ._sensors import CAMERA, SensorConfig, Sensors
from ._step import TrackerState
from ._table import TrackTable
from .clock import JumpedClock


def to_plain(sensors: Sensors, history: History, admission: Admission) -> dict[str, Any]:
    """Return a tracker as plain JSON values."""
    leap = admission.leap
    return {
        "format": FORMAT,
        "version": VERSION,
        "config": sensors.config.model_dump(mode="json"),
        "sensors": {
            sensor.name: sensor.settings.model_dump(mode="json") for sensor in sensors.all[1:]
        },
        "sensor_order": list(sensors.names),
        "refused_late_frames": admission.late_frames,
        "clock": {
            "refused_early_frames": admission.early_frames,
            "restarts": admission.restarts,
            "jumped": _plain_jumps(admission.jumped),
            "refused_frames": dict(admission.refused),
            "ahead": _plain_jumps(admission.ahead),
            "leap": None
            if leap is None
            else {
                "sensor": leap.sensor,
                "stamp_s": leap.stamp_s,
                "before": _plain_history(leap.before, sensors),
            },
        },
        **_plain_history(history, sensors),
    }


def sensors_in(
    record: TrackerRecord, given: Mapping[str, SensorConfig] | None
) -> dict[str, SensorConfig]:
    """Return the sensors of a record in its order, with the views of those that are ``given``.

    Raises:
        TrackingError: if other sensors are given than the record has.
    """
    if given is None:
        given = record.sensors
    differing = [
        name
        for name in dict.fromkeys((*record.sensors, *given))
        if name not in given
        or name not in record.sensors
        or given[name].model_dump() != record.sensors[name].model_dump()
    ]
    if differing:
        raise TrackingError(
            f"sensors must be those of the saved tracker, {list(record.sensors)}, with their "
            f"settings; got {list(given)}, and these differ: {differing}"
        )
    if record.sensor_order[0] != CAMERA:
        raise TrackingError(f"sensor_order must begin with {CAMERA!r}, got {record.sensor_order}")
    return {name: given[name] for name in record.sensor_order[1:]}


def history_of(record: TrackerRecord, empty: History, sensors: Sensors) -> History:
    """Return the history that a record describes, for the tracker of an ``empty`` one."""
    return _history_of(record, "", record.config, empty, sensors)


def restore_admission(
    admission: Admission, record: TrackerRecord, empty: History, sensors: Sensors
) -> None:
    """Set what a tracker knows of its clocks to what a record describes."""
    clock, leap = record.clock, record.clock.leap
    admission.late_frames = record.refused_late_frames
    admission.early_frames = clock.refused_early_frames
    admission.restarts = clock.restarts
    admission.refused.update(clock.refused_frames)
    admission.jumped, admission.ahead = _jumps(clock.jumped), _jumps(clock.ahead)
    if leap is not None:
        before = _history_of(leap.before, "clock.leap.before.", record.config, empty, sensors)
        admission.leap = Leap(before, leap.sensor, leap.stamp_s)


def _jumps(records: Mapping[str, JumpedClockRecord]) -> dict[str, JumpedClock]:
    return {name: JumpedClock(one.first_s, one.last_s, one.stamps) for name, one in records.items()}


def _plain_jumps(jumps: Mapping[str, JumpedClock]) -> dict[str, Any]:
    return {name: asdict(one) for name, one in jumps.items()}


def _history_of(
    record: HistoryRecord, name: str, config: TrackerConfig, empty: History, sensors: Sensors
) -> History:
    names = sensors.names
    return empty.restored(
        state_of(record.base, names, config, f"{name}base"),
        [frame_of(one, names, f"{name}frames[{i}]") for i, one in enumerate(record.frames)],
        state_of(record.latest, names, config, f"{name}latest"),
    )


def state_of(
    record: StateRecord, names: Sequence[str], config: TrackerConfig, name: str
) -> TrackerState:
    """Return the state that a record describes; ``name`` is for messages."""
    confirm_hits, tracks = config.confirm_hits, record.tracks
    for index, covariance in enumerate(tracks.covariances):
        covariance_matrix(f"{name}.tracks.covariances[{index}]", covariance, 4, TrackingError)
    count = len(tracks.ids)
    table = TrackTable(
        ids=np.array(tracks.ids, dtype=np.int64),
        states=_array(tracks.states).reshape(count, 4),
        covariances=_array(tracks.covariances).reshape(count, 4, 4),
        awareness_means=_array(tracks.awareness_means),
        awareness_variances=_array(tracks.awareness_variances),
        awareness_bounds=_array(tracks.awareness_bounds, -math.inf),
        evidence_stamps_s=_array(tracks.evidence_stamps_s, math.nan),
        hit_stamps_s=_array(
            [stamp for row in tracks.hit_stamps_s for stamp in row], -math.inf
        ).reshape(count, confirm_hits),
        confirmed=np.array(tracks.confirmed, dtype=np.bool_),
        standing=np.array(tracks.standing, dtype=np.bool_),
        seen_stamps_s=_array(
            [stamp for row in tracks.seen_stamps_s for stamp in row], -math.inf
        ).reshape(count, len(names)),
        missed_s=_array([one for row in tracks.missed_s for one in row]).reshape(count, len(names)),
        passed_stamps_s=_array(
            [one for row in tracks.passed_stamps_s for one in row], -math.inf
        ).reshape(count, len(names)),
        existence_logits=_array(tracks.existence_logits),
        birth_stamps_s=_array(tracks.birth_stamps_s),
        birth_places_camera_m=_array(tracks.birth_places_camera_m).reshape(count, 2),
        last_places_camera_m=_array(tracks.last_places_camera_m).reshape(count, 2),
        host_ids=np.array(tracks.host_ids, dtype=np.int64),
        twin_logits=_array(tracks.twin_logits),
        twin_visibilities=_array(tracks.twin_visibilities),
        twin_priors=_array(tracks.twin_priors),
        twins=np.array(tracks.twins, dtype=np.bool_),
        looked_s=_array(tracks.looked_s),
        look_stamps_s=_array(tracks.look_stamps_s, math.nan),
        look_velocities_mps=_array(tracks.look_velocities_mps).reshape(count, 2),
        look_speeds_mps=_array(tracks.look_speeds_mps),
        look_standing=np.array(tracks.look_standing, dtype=np.bool_),
        averted_s=_array(tracks.averted_s),
        lasting_stds=_array(tracks.lasting_stds),
        size_logs=_array(tracks.size_logs),
        size_variances=_array(tracks.size_variances, math.inf),
    )
    events = record.exits
    exits = Exits(
        _array(events.places_camera_m).reshape(-1, 2),
        np.array(events.returned, dtype=np.bool_),
        math.nan if events.start_s is None else events.start_s,
    )
    return TrackerState(
        table,
        tuple(_clock(record.clocks[sensor]) for sensor in names),
        record.next_id,
        record.stamp_s,
        _clock(record.faces),
        exits,
        record.origin_odom_m,
        record.origin_velocity_mps,
    )


def _clock(record: FrameClockRecord) -> FrameClock:
    return FrameClock(
        record.stamp_s,
        math.inf if record.interval_s is None else record.interval_s,
        math.inf if record.period_s is None else record.period_s,
    )


def frame_of(record: FrameRecord, names: Sequence[str], name: str) -> Frame:
    """Return the frame that a record describes; ``name`` is for messages."""
    if record.sensor not in names:
        raise TrackingError(
            f"{name}.sensor must be one of {', '.join(names)}, got {record.sensor!r}"
        )
    for index, noise in enumerate(record.noises_m2):
        covariance_matrix(f"{name}.noises_m2[{index}]", noise, 2, TrackingError)
    count = len(record.positions_odom_m)
    return Frame(
        record.stamp_s,
        rigid_transform(f"{name}.T_odom_camera", record.T_odom_camera, TrackingError),
        Measurements(
            _array(record.positions_odom_m).reshape(count, 2),
            _array(record.noises_m2).reshape(count, 2, 2),
            _array(record.evidence_means, math.nan),
            _array(record.evidence_variances, math.nan),
            np.array(record.weak, dtype=np.bool_),
            _array(record.lasting_stds),
            _array(record.size_logs, math.nan),
            _array(record.size_variances, math.nan),
        ),
        list(names).index(record.sensor),
    )


def _plain_clock(clock: FrameClock) -> dict[str, Any]:
    return {
        "stamp_s": clock.stamp_s,
        "interval_s": clock.interval_s if math.isfinite(clock.interval_s) else None,
        "period_s": clock.period_s if math.isfinite(clock.period_s) else None,
    }


def _plain_history(history: History, sensors: Sensors) -> dict[str, Any]:
    return {
        "base": _plain_state(history.base, sensors),
        "frames": [_plain_frame(frame, sensors) for frame in history.frames],
        "latest": _plain_state(history.latest, sensors),
    }


def _plain_state(state: TrackerState, sensors: Sensors) -> dict[str, Any]:
    tracks = state.tracks
    return {
        "stamp_s": state.stamp_s,
        "clocks": {
            name: _plain_clock(clock)
            for name, clock in zip(sensors.names, state.clocks, strict=True)
        },
        "faces": _plain_clock(state.faces),
        "origin_odom_m": state.origin_odom_m,
        "origin_velocity_mps": state.origin_velocity_mps,
        "exits": {
            "places_camera_m": state.exits.places_camera_m.tolist(),
            "returned": state.exits.returned.tolist(),
            "start_s": state.exits.start_s if math.isfinite(state.exits.start_s) else None,
        },
        "next_id": state.next_id,
        "tracks": {
            "ids": tracks.ids.tolist(),
            "states": tracks.states.tolist(),
            "covariances": tracks.covariances.tolist(),
            "awareness_means": tracks.awareness_means.tolist(),
            "awareness_variances": tracks.awareness_variances.tolist(),
            "awareness_bounds": _finite_or_none(tracks.awareness_bounds),
            "evidence_stamps_s": _finite_or_none(tracks.evidence_stamps_s),
            "hit_stamps_s": [_finite_or_none(row) for row in tracks.hit_stamps_s],
            "confirmed": tracks.confirmed.tolist(),
            "standing": tracks.standing.tolist(),
            "seen_stamps_s": [_finite_or_none(row) for row in tracks.seen_stamps_s],
            "missed_s": tracks.missed_s.tolist(),
            "passed_stamps_s": [_finite_or_none(row) for row in tracks.passed_stamps_s],
            "existence_logits": tracks.existence_logits.tolist(),
            "birth_stamps_s": tracks.birth_stamps_s.tolist(),
            "birth_places_camera_m": tracks.birth_places_camera_m.tolist(),
            "last_places_camera_m": tracks.last_places_camera_m.tolist(),
            "host_ids": tracks.host_ids.tolist(),
            "twin_logits": tracks.twin_logits.tolist(),
            "twin_visibilities": tracks.twin_visibilities.tolist(),
            "twin_priors": tracks.twin_priors.tolist(),
            "twins": tracks.twins.tolist(),
            "looked_s": tracks.looked_s.tolist(),
            "look_stamps_s": _finite_or_none(tracks.look_stamps_s),
            "look_velocities_mps": tracks.look_velocities_mps.tolist(),
            "look_speeds_mps": tracks.look_speeds_mps.tolist(),
            "look_standing": tracks.look_standing.tolist(),
            "averted_s": tracks.averted_s.tolist(),
            "lasting_stds": tracks.lasting_stds.tolist(),
            "size_logs": tracks.size_logs.tolist(),
            "size_variances": _finite_or_none(tracks.size_variances),
        },
    }


def _plain_frame(frame: Frame, sensors: Sensors) -> dict[str, Any]:
    measured = frame.measurements
    return {
        "sensor": sensors.names[frame.sensor],
        "stamp_s": frame.stamp_s,
        "T_odom_camera": frame.T_odom_camera.tolist(),
        "positions_odom_m": measured.positions_odom_m.tolist(),
        "noises_m2": measured.noises_m2.tolist(),
        "evidence_means": _finite_or_none(measured.evidence_means),
        "evidence_variances": _finite_or_none(measured.evidence_variances),
        "weak": measured.weak.tolist(),
        "lasting_stds": measured.lasting_stds.tolist(),
        "size_logs": _finite_or_none(measured.size_logs),
        "size_variances": _finite_or_none(measured.size_variances),
    }


def _finite_or_none(values: FloatArray) -> list[float | None]:
    """Return numbers as a list, with None for those that are not finite, which JSON cannot hold."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


def _array(values: Sequence[Any], missing: float = math.nan) -> FloatArray:
    """Return numbers as a float64 array, with ``missing`` for None."""
    return np.array([missing if value is None else value for value in values], dtype=np.float64)
