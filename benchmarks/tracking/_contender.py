"""What the benchmark asks of a tracker."""

from __future__ import annotations

from typing import Any, Protocol

from ._judges import TrackedFrame
from ._measurements import Recording

#: Every tracker keeps a person unseen for this long: a little longer than the longest spell out of
#: sight. Settings that peers do not share are tuned for each, on seeds that are not judged.
MAX_UNSEEN_S = 1.2


class Contender(Protocol):
    """A tracker under test, fed frame by frame.

    ``begin`` makes a fresh tracker and brings the measurements into its own form; ``advance`` is
    what a robot would call for every frame and all that is timed; ``report`` reads its result.
    """

    name: str

    def begin(self, recording: Recording) -> None:
        """Start over, on this recording."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""

    def report(self, result: Any) -> TrackedFrame:
        """Return the people whom the tracker holds for real, seen in this frame or not."""


def run(contender: Contender, recording: Recording) -> list[TrackedFrame]:
    """Return what a tracker makes of a recording."""
    contender.begin(recording)
    return [contender.report(contender.advance(i)) for i in range(len(recording.stamps_s))]
