"""The latest frames and the states between them, so that a late frame can take its place."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from typing import Final

from ._errors import TrackingError
from ._measurement import Frame
from ._step import TrackerState

# Memory has a bound at any frame rate, and so has the work that one late frame can cause.
MAX_FRAMES: Final = 256


class History:
    """A state, the frames that came after it, and the state after each of them.

    The frames span the lag, so a frame from within it finds the state that it belongs after. States
    are values and share what they have in common: keeping them costs no copying.

    Args:
        advance: the state after one more frame.
        max_lag_s: ≥ 0, how far before the latest frame the kept ones reach back.
        base: the state before the first of ``frames``.
        frames: in the order of their stamps.
        latest: the state after the last frame, where it is known already.
    """

    def __init__(
        self,
        advance: Callable[[TrackerState, Frame], TrackerState],
        max_lag_s: float,
        base: TrackerState,
        frames: Sequence[Frame] = (),
        latest: TrackerState | None = None,
    ) -> None:
        self._advance = advance
        self._max_lag_s = max_lag_s
        self._base = base
        self._frames: list[Frame] = list(frames)
        self._states = self._after(base, frames)
        if latest is not None and self._states:
            self._states[-1] = latest

    @property
    def base(self) -> TrackerState:
        """The state before the first frame that is kept."""
        return self._base

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The frames that are kept, in the order of their stamps."""
        return tuple(self._frames)

    @property
    def latest(self) -> TrackerState:
        """The state after all frames."""
        return self._states[-1] if self._states else self._base

    def refusal(self, stamp_s: float) -> str | None:
        """Return why a frame at ``stamp_s`` would come too late, or None when it would not."""
        last_s = self.latest.stamp_s
        if last_s is None or stamp_s >= last_s:
            return None
        late = f"cannot update at stamp_s = {stamp_s!r} s: the last frame was at {last_s!r} s"
        if stamp_s < last_s - self._max_lag_s:
            return f"{late}, and a frame may come at most max_lag_s = {self._max_lag_s:g} s late"
        if self._base.stamp_s is not None and stamp_s < self._base.stamp_s:
            return (
                f"{late}, and more than the {MAX_FRAMES} frames that are kept for replay have "
                "come since"
            )
        return None

    def insert(self, frame: Frame) -> None:
        """Put a frame in its place and work out the states from there on again.

        Among frames of one stamp it comes last. When a step fails nothing has changed.

        Raises:
            TrackingError: for a frame that comes too late.
        """
        refused = self.refusal(frame.stamp_s)
        if refused is not None:
            raise TrackingError(refused)
        place = bisect_right(self._frames, frame.stamp_s, key=_stamp_of)
        before = self._states[place - 1] if place else self._base
        later = [frame, *self._frames[place:]]
        states = self._after(before, later)
        self._frames[place:] = later
        self._states[place:] = states
        self._forget()

    def _after(self, state: TrackerState, frames: Sequence[Frame]) -> list[TrackerState]:
        states: list[TrackerState] = []
        for frame in frames:
            state = self._advance(state, frame)
            states.append(state)
        return states

    def _forget(self) -> None:
        """Let go of the frames that no frame within the lag can come before."""
        oldest_s = self._frames[-1].stamp_s - self._max_lag_s
        surplus = max(
            bisect_left(self._frames, oldest_s, key=_stamp_of), len(self._frames) - MAX_FRAMES
        )
        if surplus > 0:
            self._base = self._states[surplus - 1]
            del self._frames[:surplus], self._states[:surplus]


def _stamp_of(frame: Frame) -> float:
    return frame.stamp_s
