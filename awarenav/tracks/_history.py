"""The history of every track of a recording, and the path of the camera."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray

# After a longer time without a frame, the camera has paused.
_PAUSE_S: Final = 0.5


@dataclass(slots=True, eq=False)
class TrackSample:
    """The state of a track at ``stamp_s``.

    Attributes:
        stamp_s: time of the state.
        status: ``"tentative"``, ``"confirmed"``, ``"coasting"``; ``"given"`` without a tracker.
        is_frame: whether there is a frame at this time; False for a prediction between frames.
        seen: whether that frame shows the person.
        position_odom_m: (2,).
        velocity_odom_mps: (2,), or None if it is not known.
        position_covariance_m2: (2, 2), or None if it is not known.
        awareness: filtered α; NaN without a filter, as the two below.
        awareness_std: its standard deviation.
        awareness_lower: its lower bound, which navigation uses.
        measured_awareness: α of the frame's own observation; None without evidence.
        measured_awareness_std: its standard deviation.
        covariance_odom: (4, 4) of position and velocity, or None if it is not known.
    """

    stamp_s: float
    status: str
    is_frame: bool
    seen: bool
    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray | None
    position_covariance_m2: FloatArray | None
    awareness: float
    awareness_std: float
    awareness_lower: float
    measured_awareness: float | None = None
    measured_awareness_std: float | None = None
    covariance_odom: FloatArray | None = None


class TrackHistory:
    """The samples of a track in the order of their stamps.

    Attributes:
        samples: of frames, and of predictions between them.
        died_s: stamp at which the track was gone; None if it lasts to the end of the recording.

    Args:
        id: of the track.
        first: its first sample.
    """

    def __init__(self, id: int, first: TrackSample) -> None:
        self.id = id
        self.samples: list[TrackSample] = [first]
        self.died_s: float | None = None

    def add(self, sample: TrackSample) -> None:
        """Append a sample; a second sample of the latest stamp replaces the first.

        Raises:
            ValueError: for a stamp before the latest.
        """
        latest = self.samples[-1]
        if sample.stamp_s < latest.stamp_s:
            raise ValueError(f"stamps go back: {sample.stamp_s} s after {latest.stamp_s} s")
        if sample.stamp_s == latest.stamp_s:
            # What one of the two frames has seen stays seen.
            sample.seen = sample.seen or latest.seen
            if sample.measured_awareness is None:
                sample.measured_awareness = latest.measured_awareness
                sample.measured_awareness_std = latest.measured_awareness_std
            self.samples[-1] = sample
        else:
            self.samples.append(sample)

    @property
    def frames(self) -> list[TrackSample]:
        """The samples of frames, without the predictions between them."""
        return [sample for sample in self.samples if sample.is_frame]

    @property
    def born_s(self) -> float:
        """Stamp of the first frame."""
        return self.samples[0].stamp_s

    @property
    def confirmed_s(self) -> float | None:
        """Stamp at which the track was first more than tentative; None if it never was."""
        for sample in self.samples:
            if sample.status != "tentative":
                return sample.stamp_s
        return None

    @property
    def seen_frames(self) -> int:
        """Number of frames that show the person."""
        return sum(sample.seen for sample in self.frames)

    @property
    def stamps_s(self) -> FloatArray:
        """(N,) stamps of all samples."""
        return np.array([sample.stamp_s for sample in self.samples])

    @property
    def positions_odom_m(self) -> FloatArray:
        """(N, 2) positions of all samples."""
        return np.array([sample.position_odom_m for sample in self.samples])

    def values(self, name: str) -> FloatArray:
        """Return an awareness field of all samples (N,), NaN where it is None."""
        values = (getattr(sample, name) for sample in self.samples)
        return np.array([math.nan if value is None else value for value in values])

    def mean(self, name: str) -> float:
        """Return the mean of an awareness field over the frames; NaN if none has a value."""
        values = [getattr(sample, name) for sample in self.frames]
        values = [value for value in values if value is not None and math.isfinite(value)]
        return sum(values) / len(values) if values else math.nan

    def unseen_spans(self) -> Iterator[tuple[float, float]]:
        """Yield start and end (s) of each time in which no frame shows the person.

        A span begins with the last frame that shows the person and ends with the next one that
        does, or with the track. In between there are frames that do not show the person, or the
        camera pauses.
        """
        seen_s, missed = self.born_s, False
        for sample in self.samples:
            if sample.seen:
                if missed or sample.stamp_s - seen_s > _PAUSE_S:
                    yield seen_s, sample.stamp_s
                seen_s, missed = sample.stamp_s, False
            else:
                missed = missed or sample.is_frame
        end_s = self.samples[-1].stamp_s if self.died_s is None else self.died_s
        if end_s > seen_s:
            yield seen_s, end_s

    def segments(self) -> Iterator[tuple[str, list[TrackSample]]]:
        """Yield stretches of one status; each begins with the last sample of the one before.

        Without a tracker, a segment also ends at a longer time without a frame of the person.
        """
        segment = [self.samples[0]]
        status = self.samples[0].status
        for before, sample in itertools.pairwise(self.samples):
            away = sample.status == "given" and sample.stamp_s - before.stamp_s > _PAUSE_S
            if away or sample.status != status:
                yield status, segment
                status = sample.status
                segment = [] if away else [before]
            segment.append(sample)
        yield status, segment


class HistoryBuilder:
    """Collects the history of every track, frame by frame."""

    def __init__(self) -> None:
        self._histories: dict[int, TrackHistory] = {}
        self._living: set[int] = set()

    def add(self, stamp_s: float, samples: Iterable[tuple[int, TrackSample]]) -> None:
        """Add the id and the sample of every track at a time; stamps must not go back.

        A track that is not among them has died. It lives again if it comes back, as people in a
        file without a tracker can.
        """
        present: set[int] = set()
        for id, sample in samples:
            present.add(id)
            history = self._histories.get(id)
            if history is None:
                self._histories[id] = TrackHistory(id, sample)
            else:
                history.died_s = None
                history.add(sample)
        for id in self._living - present:
            self._histories[id].died_s = stamp_s
        self._living = present

    def histories(self) -> tuple[TrackHistory, ...]:
        """Return all histories in the order of their ids."""
        return tuple(self._histories[id] for id in sorted(self._histories))


@dataclass(frozen=True, slots=True, eq=False)
class TrackedRecording:
    """The tracks of a recording, and the path of its camera.

    Attributes:
        histories: in the order of their ids.
        camera_stamps_s: (N,) stamps of the frames, ascending.
        camera_poses: (N, 3) x, y (m) and heading (rad) of the camera's view in odom.
        remarks: sentences about frames that were late or refused.
        source: where the ids come from, for the title.
    """

    histories: tuple[TrackHistory, ...]
    camera_stamps_s: FloatArray
    camera_poses: FloatArray
    remarks: tuple[str, ...]
    source: str

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last stamp; (0, 0) without a frame."""
        if not len(self.camera_stamps_s):
            return 0.0, 0.0
        return float(self.camera_stamps_s[0]), float(self.camera_stamps_s[-1])

    @property
    def camera_jump_m(self) -> float:
        """Median distance of the camera from frame to frame; 0 for fewer than three frames.

        Several metres mean single images of many places, as ``awarenav render`` makes, not a drive.
        """
        if len(self.camera_poses) < 3:
            return 0.0
        steps = np.diff(self.camera_poses[:, :2], axis=0)
        return float(np.median(np.hypot(steps[:, 0], steps[:, 1])))
