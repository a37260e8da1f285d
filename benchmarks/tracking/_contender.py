"""Interface of a tracker in the benchmark."""

from __future__ import annotations

from typing import Any, Protocol

from ._judges import TrackedFrame
from ._measurements import SimulatedRecording

#: Time for which every tracker keeps an unseen person: slightly more than the longest spell out of
#: sight. Settings that the trackers do not share are tuned for each, on seeds that are not judged.
MAX_UNSEEN_S = 1.2


class Contender(Protocol):
    """A tracker under test, fed frame by frame.

    ``begin`` makes a fresh tracker. ``make`` converts the measurements of a frame into the
    tracker's own form, ``advance`` is the call of every frame: these two are timed. ``report``
    reads its result.
    """

    name: str

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""

    def make(self, frame: int) -> None:
        """Make the input of the next frame."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""

    def report(self, result: Any) -> TrackedFrame:
        """Return the confirmed people, seen in this frame or not."""


def run(contender: Contender, recording: SimulatedRecording) -> list[TrackedFrame]:
    """Return the tracks of every frame of a recording."""
    contender.begin(recording)
    tracked = []
    for frame in range(len(recording.stamps_s)):
        contender.make(frame)
        tracked.append(contender.report(contender.advance(frame)))
    return tracked
