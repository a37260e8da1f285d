"""Conversion of a tracker's state to plain JSON values and back, without loss of a bit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from pydantic import Field, ValidationError, model_validator

from perception.arrays import FloatArray, covariance_matrix, rigid_transform

from ._config import TrackerConfig
from ._errors import TrackingError
from ._exits import MAX_EVENTS, Exits
from ._measurement import Frame, Measurements
from ._step import TrackerState
from ._table import TrackTable
from .clock import JumpedClock
from .config import StrictConfig

FORMAT: Final = "awarenav-tracker"
VERSION: Final = 2

_Two: TypeAlias = tuple[float, float]
_Four: TypeAlias = tuple[float, float, float, float]


class _TracksRecord(StrictConfig):
    """A :class:`TrackTable`, column by column; null for numbers that are not finite."""

    ids: list[int]
    states: list[_Four]
    covariances: list[tuple[_Four, _Four, _Four, _Four]]
    awareness_means: list[float]
    awareness_variances: list[float]
    awareness_bounds: list[float | None]
    evidence_stamps_s: list[float | None]
    hit_stamps_s: list[list[float | None]]
    confirmed: list[bool]
    standing: list[bool]
    missed_s: list[float]
    existence_logits: list[float]
    birth_stamps_s: list[float]
    birth_places_camera_m: list[_Two]
    last_places_camera_m: list[_Two]
    host_ids: list[int]
    twin_logits: list[float]
    twin_visibilities: list[float]
    twin_priors: list[float]
    twins: list[bool]

    @model_validator(mode="after")
    def _check_consistency(self) -> _TracksRecord:
        lengths = {name: len(getattr(self, name)) for name in type(self).model_fields}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"every column must have one entry per track, got {lengths}")
        if any(a >= b for a, b in zip([0, *self.ids], self.ids, strict=False)):
            raise ValueError(f"ids must be above 0 and increase, got {self.ids}")
        if any(not variance > 0.0 for variance in self.awareness_variances):
            raise ValueError("awareness_variances must be above 0")
        known = {0, *self.ids}
        for own, host, twin in zip(self.ids, self.host_ids, self.twins, strict=True):
            if host == own or host not in known or (twin and host == 0):
                raise ValueError(
                    f"host_ids must hold the id of another track, or 0 without a twin, got {host} "
                    f"for track {own}"
                )
        return self


class _ExitsRecord(StrictConfig):
    """:class:`Exits` as plain values."""

    places_camera_m: list[_Two] = Field(max_length=MAX_EVENTS)
    returned: list[bool]
    start_s: float | None

    @model_validator(mode="after")
    def _check_consistency(self) -> _ExitsRecord:
        if len(self.places_camera_m) != len(self.returned):
            raise ValueError("places_camera_m and returned must be of one length")
        return self


class _StateRecord(StrictConfig):
    """A :class:`TrackerState` as plain values."""

    stamp_s: float | None
    interval_s: float | None
    period_s: float | None = Field(gt=0.0)
    exits: _ExitsRecord
    next_id: int = Field(ge=1, lt=2**63)
    tracks: _TracksRecord

    @model_validator(mode="after")
    def _check_consistency(self) -> _StateRecord:
        if self.tracks.ids and self.tracks.ids[-1] >= self.next_id:
            raise ValueError(
                f"next_id must be above every id in use, got {self.next_id} with a track "
                f"{self.tracks.ids[-1]}"
            )
        if self.tracks.ids and self.stamp_s is None:
            raise ValueError("stamp_s must be a number if there are tracks")
        for row in self.tracks.hit_stamps_s:
            seen_s = row[-1] if row else None
            if seen_s is None or self.stamp_s is None or seen_s > self.stamp_s:
                raise ValueError(
                    f"hit_stamps_s must end in a stamp of at most {self.stamp_s} s, got {row}"
                )
        return self


class _FrameRecord(StrictConfig):
    """A :class:`Frame` as plain values."""

    stamp_s: float
    T_odom_camera: tuple[_Four, _Four, _Four, _Four]
    positions_odom_m: list[_Two]
    noises_m2: list[tuple[_Two, _Two]]
    evidence_means: list[float | None]
    evidence_variances: list[float | None]
    weak: list[bool]

    @model_validator(mode="after")
    def _check_consistency(self) -> _FrameRecord:
        lengths = {
            len(self.positions_odom_m),
            len(self.noises_m2),
            len(self.evidence_means),
            len(self.evidence_variances),
            len(self.weak),
        }
        if len(lengths) > 1:
            raise ValueError("every column of a frame must have one entry per observation")
        return self


class _JumpedClockRecord(StrictConfig):
    """:class:`~tracking.clock.JumpedClock` as plain values."""

    first_s: float
    last_s: float
    stamps: int = Field(ge=1)


class _ClockRecord(StrictConfig):
    """Jumps of the clock."""

    refused_early_frames: int = Field(ge=0)
    restarts: int = Field(ge=0)
    jumped: _JumpedClockRecord | None


class TrackerRecord(StrictConfig):
    """A tracker without its view, but with the frames that may still be replayed."""

    format: Literal["awarenav-tracker"]
    version: Literal[2]
    config: TrackerConfig
    refused_late_frames: int = Field(ge=0)
    clock: _ClockRecord
    base: _StateRecord
    frames: list[_FrameRecord]
    latest: _StateRecord

    @model_validator(mode="after")
    def _check_consistency(self) -> TrackerRecord:
        stamps = [frame.stamp_s for frame in self.frames]
        if self.base.stamp_s is not None:
            stamps.insert(0, self.base.stamp_s)
        if stamps != sorted(stamps):
            raise ValueError("stamps of base and frames must not go back")
        if self.latest.stamp_s != (stamps[-1] if stamps else None):
            raise ValueError(
                f"latest.stamp_s must be that of the last frame, got {self.latest.stamp_s}"
            )
        for state in (self.base, self.latest):
            if any(len(row) != self.config.confirm_hits for row in state.tracks.hit_stamps_s):
                raise ValueError(
                    f"hit_stamps_s must hold confirm_hits = {self.config.confirm_hits} stamps per "
                    "track"
                )
        return self


def to_plain(
    config: TrackerConfig,
    refused_late_frames: int,
    base: TrackerState,
    frames: Sequence[Frame],
    latest: TrackerState,
    *,
    clock: tuple[int, int, JumpedClock | None],
) -> dict[str, Any]:
    """Return a tracker as plain JSON values.

    ``clock`` has the numbers of early frames and of restarts, and the clock that may be new.
    """
    early_frames, restarts, jumped = clock
    return {
        "format": FORMAT,
        "version": VERSION,
        "config": config.model_dump(mode="json"),
        "refused_late_frames": refused_late_frames,
        "clock": {
            "refused_early_frames": early_frames,
            "restarts": restarts,
            "jumped": None if jumped is None else asdict(jumped),
        },
        "base": _plain_state(base),
        "frames": [_plain_frame(frame) for frame in frames],
        "latest": _plain_state(latest),
    }


def record_of(state: Any) -> TrackerRecord:
    """Return plain values as a checked record.

    Raises:
        TrackingError: for values that :func:`to_plain` has not written.
    """
    if not isinstance(state, dict):
        raise TrackingError(f"state must be a mapping, got {type(state).__name__}")
    if state.get("format") != FORMAT:
        raise TrackingError(
            f"state must have format {FORMAT!r}, as a tracker's state() does, "
            f"got {state.get('format')!r}"
        )
    if state.get("version") != VERSION:
        raise TrackingError(
            f"state must have version {VERSION}, the one that this release reads and writes, "
            f"got {state.get('version')!r}"
        )
    try:
        return TrackerRecord.model_validate(state)
    except ValidationError as cause:
        raise TrackingError(f"state is not the state of a tracker: {cause}") from cause


def state_of(record: _StateRecord, confirm_hits: int, name: str) -> TrackerState:
    """Return the state that a record describes; ``name`` is for messages."""
    tracks = record.tracks
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
        missed_s=_array(tracks.missed_s),
        existence_logits=_array(tracks.existence_logits),
        birth_stamps_s=_array(tracks.birth_stamps_s),
        birth_places_camera_m=_array(tracks.birth_places_camera_m).reshape(count, 2),
        last_places_camera_m=_array(tracks.last_places_camera_m).reshape(count, 2),
        host_ids=np.array(tracks.host_ids, dtype=np.int64),
        twin_logits=_array(tracks.twin_logits),
        twin_visibilities=_array(tracks.twin_visibilities),
        twin_priors=_array(tracks.twin_priors),
        twins=np.array(tracks.twins, dtype=np.bool_),
    )
    events = record.exits
    exits = Exits(
        _array(events.places_camera_m).reshape(-1, 2),
        np.array(events.returned, dtype=np.bool_),
        math.nan if events.start_s is None else events.start_s,
    )
    interval_s = math.inf if record.interval_s is None else record.interval_s
    period_s = math.inf if record.period_s is None else record.period_s
    return TrackerState(table, record.next_id, record.stamp_s, interval_s, period_s, exits)


def frame_of(record: _FrameRecord, name: str) -> Frame:
    """Return the frame that a record describes; ``name`` is for messages."""
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
        ),
    )


def _plain_state(state: TrackerState) -> dict[str, Any]:
    tracks = state.tracks
    return {
        "stamp_s": state.stamp_s,
        "interval_s": state.interval_s if math.isfinite(state.interval_s) else None,
        "period_s": state.period_s if math.isfinite(state.period_s) else None,
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
            "missed_s": tracks.missed_s.tolist(),
            "existence_logits": tracks.existence_logits.tolist(),
            "birth_stamps_s": tracks.birth_stamps_s.tolist(),
            "birth_places_camera_m": tracks.birth_places_camera_m.tolist(),
            "last_places_camera_m": tracks.last_places_camera_m.tolist(),
            "host_ids": tracks.host_ids.tolist(),
            "twin_logits": tracks.twin_logits.tolist(),
            "twin_visibilities": tracks.twin_visibilities.tolist(),
            "twin_priors": tracks.twin_priors.tolist(),
            "twins": tracks.twins.tolist(),
        },
    }


def _plain_frame(frame: Frame) -> dict[str, Any]:
    measured = frame.measurements
    return {
        "stamp_s": frame.stamp_s,
        "T_odom_camera": frame.T_odom_camera.tolist(),
        "positions_odom_m": measured.positions_odom_m.tolist(),
        "noises_m2": measured.noises_m2.tolist(),
        "evidence_means": _finite_or_none(measured.evidence_means),
        "evidence_variances": _finite_or_none(measured.evidence_variances),
        "weak": measured.weak.tolist(),
    }


def _finite_or_none(values: FloatArray) -> list[float | None]:
    """Return numbers as a list, with None for those that are not finite, which JSON cannot hold."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


def _array(values: Sequence[Any], missing: float = math.nan) -> FloatArray:
    """Return numbers as a float64 array, with ``missing`` for None."""
    return np.array([missing if value is None else value for value in values], dtype=np.float64)
