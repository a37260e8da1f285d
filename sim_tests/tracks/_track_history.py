"""The life of one track."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._track_sample import TrackSample

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
