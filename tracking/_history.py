"""The latest frames and the states after each of them, so that late frames can be inserted."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from typing import Final

from ._errors import TrackingError
from ._frame import Frame
from ._state import State

# Bounds memory, and the work for one late frame, at any frame rate.
MAX_FRAMES: Final = 256


class History:
    """A state, the frames that came after it, and the state after each of them.

    The frames cover ``max_lag_s``. A late frame within that lag is inserted in its place, and the
    states after it are computed again. States are immutable.

    Args:
        advance: returns the state after one more frame.
        max_lag_s: ≥ 0, how far the kept frames reach back from the latest one.
        base: the state before the first frame.
    """

    def __init__(
        self,
        advance: Callable[[State, Frame], State],
        max_lag_s: float,
        base: State,
    ) -> None:
        self._advance = advance
        self._max_lag_s = max_lag_s
        self._base = base
        self._frames: list[Frame] = []
        self._states: list[State] = []

    @property
    def latest(self) -> State:
        """The state after all frames."""
        return self._states[-1] if self._states else self._base

    def lateness_error(self, stamp_s: float) -> str | None:
        """Return the message for a frame at ``stamp_s`` that is too late, or None if it is not."""
        last_s = self.latest.stamp_s
        if last_s is None or stamp_s >= last_s:
            return None
        late = f"cannot update at stamp_s = {stamp_s!r} s: the last frame was at {last_s!r} s"
        if stamp_s < last_s - self._max_lag_s:
            return f"{late}, and a frame may come at most max_lag_s = {self._max_lag_s:g} s late"
        if self._base.stamp_s is not None and stamp_s < self._base.stamp_s:
            return (
                f"{late}, and more than the {MAX_FRAMES} frames that are kept for replay have "
                "come since then"
            )
        return None

    def copy(self) -> History:
        """Return a history that goes on by itself; it shares the states."""
        copied = History(self._advance, self._max_lag_s, self._base)
        copied._frames, copied._states = list(self._frames), list(self._states)
        return copied

    def with_ids_from(self, next_id: int) -> History:
        """Return a copy whose new tracks have this id or higher ones."""
        copied = self.copy()
        latest = self.latest._replace(next_id=max(self.latest.next_id, next_id))
        if copied._states:
            copied._states[-1] = latest
        else:
            copied._base = latest
        return copied

    def insert(self, frame: Frame) -> None:
        """Insert a frame in the order of stamps and compute the states from there on again.

        Among frames with the same stamp it comes last. If a step fails, nothing changes.

        Raises:
            TrackingError: for a frame that comes too late.
        """
        late = self.lateness_error(frame.stamp_s)
        if late is not None:
            raise TrackingError(late)
        place = bisect_right(self._frames, frame.stamp_s, key=_stamp_of)
        before = self._states[place - 1] if place else self._base
        later = [frame, *self._frames[place:]]
        states = self._replay(before, later)
        self._frames[place:] = later
        self._states[place:] = states
        self._drop_old_frames()

    def _replay(self, state: State, frames: Sequence[Frame]) -> list[State]:
        """Return the state after each of the frames."""
        states: list[State] = []
        for frame in frames:
            state = self._advance(state, frame)
            states.append(state)
        return states

    def _drop_old_frames(self) -> None:
        """Drop the frames that are older than the lag, or more than :data:`MAX_FRAMES`."""
        oldest_s = self._frames[-1].stamp_s - self._max_lag_s
        surplus = max(
            bisect_left(self._frames, oldest_s, key=_stamp_of), len(self._frames) - MAX_FRAMES
        )
        if surplus > 0:
            self._base = self._states[surplus - 1]
            del self._frames[:surplus], self._states[:surplus]


def _stamp_of(frame: Frame) -> float:
    return frame.stamp_s
