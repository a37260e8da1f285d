"""A source read in a thread of its own, so that decoding and estimating overlap.

Work handed to a thread of its own, in order, so that the giver need not wait for it.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Final, Generic, TypeVar

from ..closing import Closing
from ._source import ImageSource, SourceFrame

_DEPTH: Final = 4
# How long either side waits before it looks whether the other is still there.
_POLL_S: Final = 0.1


class ReadAhead(Closing):
    """Iterates over the frames of a source, a few of which are read ahead.

    A live source is never held up: the newest frame replaces one that was not taken. What the
    source raises is raised here, after the frames that came before it.

    Args:
        source: is closed with this.
        every: takes each so-many-th frame only.
        limit: at most so many; None is all.
    """

    def __init__(self, source: ImageSource, *, every: int = 1, limit: int | None = None) -> None:
        self._source = source
        self._every = every
        self._limit = limit
        self._queue: queue.Queue[SourceFrame | BaseException | None] = queue.Queue(
            1 if source.live else _DEPTH
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="read ahead", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[SourceFrame]:
        while True:
            item = self._queue.get()
            if item is None:
                return
            if isinstance(item, BaseException):
                raise item
            yield item

    def close(self) -> None:
        """Stop reading and close the source."""
        self._stop.set()
        while self._thread.is_alive():
            try:
                self._queue.get_nowait()  # lets a thread that waits for room see that it shall stop
            except queue.Empty:
                self._thread.join(_POLL_S)
        self._source.close()

    def _read(self) -> None:
        last: BaseException | None = None
        try:
            taken = 0
            for index, frame in enumerate(self._source.frames()):
                if self._stop.is_set():
                    return
                # What went wrong is always passed on.
                if index % self._every and frame.image_rgb is not None:
                    continue
                self._put(frame, newest=self._source.live and frame.image_rgb is not None)
                taken += 1
                if taken == self._limit:
                    break
        except BaseException as error:
            last = error
        self._put(last)

    def _put(self, item: SourceFrame | BaseException | None, *, newest: bool = False) -> None:
        while not self._stop.is_set():
            try:
                self._queue.put(item, timeout=0.0 if newest else _POLL_S)
                return
            except queue.Full:
                if newest:
                    try:
                        self._queue.get_nowait()
                    except queue.Empty:
                        continue


ItemT = TypeVar("ItemT")


class WriteBehind(Closing, Generic[ItemT]):
    """Calls a function with one item after another in a thread.

    What the function raises is raised by the next :meth:`put` or by :meth:`close`; nothing is
    handed to it after that.

    Args:
        work: the function.
    """

    def __init__(self, work: Callable[[ItemT], None]) -> None:
        self._work = work
        self._queue: queue.Queue[ItemT | None] = queue.Queue(_DEPTH)
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="write behind", daemon=True)
        self._thread.start()

    def put(self, item: ItemT) -> None:
        """Hand over an item; waits while several are not done yet."""
        while True:
            self._complain()
            try:
                self._queue.put(item, timeout=_POLL_S)
                return
            except queue.Full:
                continue

    def close(self) -> None:
        """Wait until everything is done."""
        while self._thread.is_alive():
            try:
                self._queue.put(None, timeout=_POLL_S)
                break
            except queue.Full:
                continue
        self._thread.join()
        self._complain()

    def _complain(self) -> None:
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                self._work(item)
            except BaseException as error:
                self._error = error
                return
