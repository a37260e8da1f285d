"""One track at one instant, for drawing and for tables.

The life of one track.

The histories of all tracks, as one frame after another tells them.

Everything that a plot of tracks shows.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray


@dataclass(slots=True, eq=False)
class TrackSample:
    """What was believed of a person at ``stamp_s``.

    Attributes:
        stamp_s: the instant.
        status: ``"tentative"``, ``"confirmed"``, ``"coasting"``; ``"given"`` without a tracker.
        is_frame: False for a prediction between two frames.
        seen: whether the frame at this instant shows the person.
        position_odom_m: (2,).
        velocity_odom_mps: (2,), or None where it is not known.
        position_covariance_m2: (2, 2), or None where it is not known.
        awareness: smoothed α; NaN where there is none, as are the two below.
        awareness_std: its standard deviation.
        awareness_lower: its lower bound, the line that counts.
        measured_awareness: α of the frame's own observation, or None without evidence.
        measured_awareness_std: its standard deviation.
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


# Longer than this without a frame, the camera has paused.
_PAUSE_S: Final = 0.5


class TrackHistory:
    """The samples of one identity in the order of their stamps.

    Args:
        id: of the track.
        first: its first sample.
    """

    def __init__(self, id: int, first: TrackSample) -> None:
        self.id = id
        self.samples: list[TrackSample] = [first]
        #: When the track was found to be gone; None while it lives to the end of the recording.
        self.died_s: float | None = None

    def add(self, sample: TrackSample) -> None:
        """Append a sample; one of the latest stamp again replaces what was known of it."""
        latest = self.samples[-1]
        if sample.stamp_s < latest.stamp_s:
            raise ValueError(f"stamps go back: {sample.stamp_s} s after {latest.stamp_s} s")
        if sample.stamp_s == latest.stamp_s:
            # A second frame of one instant: what was seen stays seen.
            sample.seen = sample.seen or latest.seen
            if sample.measured_awareness is None:
                sample.measured_awareness = latest.measured_awareness
                sample.measured_awareness_std = latest.measured_awareness_std
            self.samples[-1] = sample
        else:
            self.samples.append(sample)

    @property
    def frames(self) -> list[TrackSample]:
        """The samples of frames, without predictions between them."""
        return [sample for sample in self.samples if sample.is_frame]

    @property
    def born_s(self) -> float:
        """Stamp of the first frame."""
        return self.samples[0].stamp_s

    @property
    def confirmed_s(self) -> float | None:
        """When the track was first more than tentative."""
        for sample in self.samples:
            if sample.status != "tentative":
                return sample.stamp_s
        return None

    @property
    def seen_frames(self) -> int:
        """Frames that showed the person."""
        return sum(sample.seen for sample in self.frames)

    @property
    def stamps_s(self) -> FloatArray:
        """(N,) stamps of all samples."""
        return np.array([sample.stamp_s for sample in self.samples])

    @property
    def positions_odom_m(self) -> FloatArray:
        """(N, 2) of all samples."""
        return np.array([sample.position_odom_m for sample in self.samples])

    def numbers(self, name: str) -> FloatArray:
        """(N,) one of the awareness fields of all samples, NaN where it is None."""
        values = (getattr(sample, name) for sample in self.samples)
        return np.array([math.nan if value is None else value for value in values])

    def mean(self, name: str) -> float:
        """Mean of an awareness field over the frames; NaN where it has no value."""
        values = [getattr(sample, name) for sample in self.frames]
        values = [value for value in values if value is not None and math.isfinite(value)]
        return sum(values) / len(values) if values else math.nan

    def unseen_spans(self) -> Iterator[tuple[float, float]]:
        """Start and end (s, s) of every time in which nothing showed the person.

        That is from the last frame that showed the person to the next that does, or to the end of
        the track, with frames between that do not, or with a pause of the camera.
        """
        seen_s, overlooked = self.born_s, False
        for sample in self.samples:
            if sample.seen:
                if overlooked or sample.stamp_s - seen_s > _PAUSE_S:
                    yield seen_s, sample.stamp_s
                seen_s, overlooked = sample.stamp_s, False
            else:
                overlooked = overlooked or sample.is_frame
        end_s = self.samples[-1].stamp_s if self.died_s is None else self.died_s
        if end_s > seen_s:
            yield seen_s, end_s

    def runs(self) -> Iterator[tuple[str, list[TrackSample]]]:
        """Stretches of one status; each starts with the last sample of the one before.

        A stretch without a tracker ends where the person is not seen for a while.
        """
        stretch = [self.samples[0]]
        status = self.samples[0].status
        for before, sample in itertools.pairwise(self.samples):
            away = sample.status == "given" and sample.stamp_s - before.stamp_s > _PAUSE_S
            if away or sample.status != status:
                yield status, stretch
                status = sample.status
                stretch = [] if away else [before]
            stretch.append(sample)
        yield status, stretch


class HistoryBook:
    """Grows the history of every track and notes who has gone."""

    def __init__(self) -> None:
        self._histories: dict[int, TrackHistory] = {}
        self._living: set[int] = set()

    def note(self, stamp_s: float, samples: Iterable[tuple[int, TrackSample]]) -> None:
        """Take the id and the sample of every track that there is at an instant.

        Stamps must not go back. Who is not among them any more has died, until they are back as
        people in files without a tracker may be.
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
        """All of them in the order of their ids."""
        return tuple(self._histories[id] for id in sorted(self._histories))


@dataclass(frozen=True, slots=True, eq=False)
class TrackRun:
    """Tracks and the camera that saw them.

    Attributes:
        histories: in the order of their ids.
        camera_stamps_s: (N,) of the frames, ascending.
        camera_poses: (N, 3) x, y (m) and heading (rad) of the camera's view in odom.
        remarks: sentences about frames that were refused.
        source: what the identities are, for the title.
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


def camera_jump_m(run: TrackRun) -> float:
    """How far the camera goes from frame to frame, the median (m); 0 for fewer than three frames.

    Metres mean single pictures of many places, as ``awarenav render`` makes, and not a drive.
    """
    if len(run.camera_poses) < 3:
        return 0.0
    steps = np.diff(run.camera_poses[:, :2], axis=0)
    return float(np.median(np.hypot(steps[:, 0], steps[:, 1])))


def camera_pose(T_odom_camera: FloatArray) -> tuple[float, float, float]:
    """Where a camera is and looks to on the floor plane: x, y (m), heading (rad)."""
    x, y = T_odom_camera[:2, 3].tolist()
    ahead = T_odom_camera[:2, 2]
    return x, y, float(np.arctan2(ahead[1], ahead[0]))
