"""The plain JSON values of a saved tracker, checked."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import Field, ValidationError, model_validator

from ._config import TrackerConfig
from ._errors import TrackingError
from ._exits import MAX_EVENTS
from ._sensors import CAMERA, SensorConfig
from .config import StrictConfig, complaints

FORMAT: Final = "awarenav-tracker"
VERSION: Final = 3

_Two: TypeAlias = tuple[float, float]
_Four: TypeAlias = tuple[float, float, float, float]


class TracksRecord(StrictConfig):
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
    seen_stamps_s: list[list[float | None]]
    missed_s: list[list[float]]
    passed_stamps_s: list[list[float | None]]
    existence_logits: list[float]
    birth_stamps_s: list[float]
    birth_places_camera_m: list[_Two]
    last_places_camera_m: list[_Two]
    host_ids: list[int]
    twin_logits: list[float]
    twin_visibilities: list[float]
    twin_priors: list[float]
    twins: list[bool]
    looked_s: list[float]
    look_stamps_s: list[float | None]
    look_velocities_mps: list[_Two]
    look_speeds_mps: list[float]
    look_standing: list[bool]
    averted_s: list[float]
    lasting_stds: list[Annotated[float, Field(ge=0.0, le=1e3)]]
    size_logs: list[float]
    size_variances: list[Annotated[float, Field(gt=0.0)] | None]

    @model_validator(mode="after")
    def _check_consistency(self) -> TracksRecord:
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


class ExitsRecord(StrictConfig):
    """:class:`Exits` as plain values."""

    places_camera_m: list[_Two] = Field(max_length=MAX_EVENTS)
    returned: list[bool]
    start_s: float | None

    @model_validator(mode="after")
    def _check_consistency(self) -> ExitsRecord:
        if len(self.places_camera_m) != len(self.returned):
            raise ValueError("places_camera_m and returned must be of one length")
        return self


class FrameClockRecord(StrictConfig):
    """A :class:`FrameClock` as plain values; null for numbers that are not finite."""

    stamp_s: float | None
    interval_s: float | None = Field(le=1e12)
    period_s: float | None = Field(gt=0.0, le=1e12)


class StateRecord(StrictConfig):
    """A :class:`TrackerState` as plain values."""

    stamp_s: float | None
    clocks: dict[str, FrameClockRecord]
    faces: FrameClockRecord
    origin_odom_m: _Two | None
    origin_velocity_mps: _Two
    exits: ExitsRecord
    next_id: int = Field(ge=1, lt=2**63)
    tracks: TracksRecord

    @model_validator(mode="after")
    def _check_consistency(self) -> StateRecord:
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
        tracks = self.tracks
        rows: list[Any] = [*tracks.seen_stamps_s, *tracks.missed_s, *tracks.passed_stamps_s]
        if any(len(row) != len(self.clocks) for row in rows):
            raise ValueError(
                "seen_stamps_s, missed_s and passed_stamps_s must hold one number per sensor, "
                f"{len(self.clocks)} in all"
            )
        return self


class FrameRecord(StrictConfig):
    """A :class:`Frame` as plain values."""

    sensor: str
    stamp_s: float
    T_odom_camera: tuple[_Four, _Four, _Four, _Four]
    positions_odom_m: list[_Two]
    noises_m2: list[tuple[_Two, _Two]]
    evidence_means: list[float | None]
    evidence_variances: list[float | None]
    weak: list[bool]
    lasting_stds: list[Annotated[float, Field(ge=0.0, le=1e3)]]
    size_logs: list[float | None]
    size_variances: list[float | None]

    @model_validator(mode="after")
    def _check_consistency(self) -> FrameRecord:
        lengths = {
            len(self.positions_odom_m),
            len(self.noises_m2),
            len(self.evidence_means),
            len(self.evidence_variances),
            len(self.weak),
            len(self.lasting_stds),
            len(self.size_logs),
            len(self.size_variances),
        }
        if len(lengths) > 1:
            raise ValueError("every column of a frame must have one entry per observation")
        return self


class JumpedClockRecord(StrictConfig):
    """:class:`~tracking.clock.JumpedClock` as plain values."""

    first_s: float
    last_s: float
    stamps: int = Field(ge=1)


class HistoryRecord(StrictConfig):
    """:class:`History` as plain values."""

    base: StateRecord
    frames: list[FrameRecord]
    latest: StateRecord

    @model_validator(mode="after")
    def _check_order(self) -> HistoryRecord:
        stamps = [frame.stamp_s for frame in self.frames]
        if self.base.stamp_s is not None:
            stamps.insert(0, self.base.stamp_s)
        if stamps != sorted(stamps):
            raise ValueError("stamps of base and frames must not go back")
        if self.latest.stamp_s != (stamps[-1] if stamps else None):
            raise ValueError(
                f"latest.stamp_s must be that of the last frame, got {self.latest.stamp_s}"
            )
        return self


class LeapRecord(StrictConfig):
    """:class:`~tracking._admission.Leap` as plain values."""

    sensor: str
    stamp_s: float
    before: HistoryRecord


class ClockRecord(StrictConfig):
    """Jumps of the clock."""

    refused_early_frames: int = Field(ge=0)
    restarts: int = Field(ge=0)
    jumped: dict[str, JumpedClockRecord]
    refused_frames: dict[str, int]
    ahead: dict[str, JumpedClockRecord]
    leap: LeapRecord | None


class TrackerRecord(HistoryRecord):
    """A tracker without its views, but with the frames that may still be replayed."""

    format: Literal["awarenav-tracker"]
    version: Literal[3]
    config: TrackerConfig
    sensors: dict[str, SensorConfig]
    sensor_order: list[str]
    """Names of all sensors in the order of the columns."""

    refused_late_frames: int = Field(ge=0)
    clock: ClockRecord

    @model_validator(mode="after")
    def _check_consistency(self) -> TrackerRecord:
        names = {CAMERA, *self.sensors}
        if sorted(self.sensor_order) != sorted(names):
            raise ValueError(
                f"sensor_order must have each of {', '.join(sorted(names))} once, "
                f"got {', '.join(self.sensor_order)}"
            )
        clock = self.clock
        if not {*clock.jumped, *clock.refused_frames, *clock.ahead} <= names:
            raise ValueError(f"clock must name only the sensors {', '.join(sorted(names))}")
        histories: list[HistoryRecord] = [self]
        if clock.leap is not None:
            histories.append(clock.leap.before)
            if clock.leap.sensor not in names or clock.leap.before.latest.stamp_s is None:
                raise ValueError("clock.leap must be of one of the sensors, and after a frame")
        for state in [each for one in histories for each in (one.base, one.latest)]:
            if set(state.clocks) != names:
                raise ValueError(
                    f"clocks must be those of the sensors {', '.join(sorted(names))}, "
                    f"got {', '.join(state.clocks)}"
                )
            if any(len(row) != self.config.confirm_hits for row in state.tracks.hit_stamps_s):
                raise ValueError(
                    f"hit_stamps_s must hold confirm_hits = {self.config.confirm_hits} stamps per "
                    "track"
                )
        return self


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
        raise TrackingError(f"state is not the state of a tracker: {complaints(cause)}") from cause
