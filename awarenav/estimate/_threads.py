"""Threads beside the estimator: one reads frames ahead, one does work in the background."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import Final, Generic, TypeVar

from ._source import ImageSource, SourceFrame

_QUEUE_SIZE: Final = 4
# Each side waits so long before it checks whether the other side has ended.
_POLL_S: Final = 0.1

_Item = TypeVar("_Item")


class FramePrefetcher(AbstractContextManager["FramePrefetcher"]):
    """Iterates over the frames of a source, a few of which a thread reads ahead.

    A live source never waits: its newest frame replaces one that was not taken yet. An error of the
    source is raised here, after the frames before it.

    Args:
        source: is closed with this object.
        every: takes every N-th frame only.
        limit: most frames to take; None for all.
    """

    def __init__(self, source: ImageSource, *, every: int = 1, limit: int | None = None) -> None:
        self._source = source
        self._every = every
        self._limit = limit
        self._queue: queue.Queue[SourceFrame | BaseException | None] = queue.Queue(
            1 if source.live else _QUEUE_SIZE
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="prefetch", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[SourceFrame]:
        while True:
            item = self._queue.get()
            if item is None:
                return
            if isinstance(item, BaseException):
                raise item
            yield item

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop reading and close the source."""
        self._stop.set()
        while self._thread.is_alive():
            try:
                self._queue.get_nowait()  # a thread that waits for a free place then sees the stop
            except queue.Empty:
                self._thread.join(_POLL_S)
        self._source.close()

    def _read(self) -> None:
        """Read frames into the queue until the end, the limit or an error (in the thread)."""
        last: BaseException | None = None
        try:
            taken = 0
            for index, frame in enumerate(self._source.frames()):
                if self._stop.is_set():
                    return
                # A frame with a problem is never skipped.
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
        """Put an item into the queue; a ``newest`` one replaces the item that is in it."""
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


class BackgroundWorker(AbstractContextManager["BackgroundWorker[_Item]"], Generic[_Item]):
    """Calls a function with one item after another, in a thread.

    An error of the function is raised by the next :meth:`put` or by :meth:`close`; the function is
    not called again after it.

    Args:
        work: the function.
    """

    def __init__(self, work: Callable[[_Item], None]) -> None:
        self._work = work
        self._queue: queue.Queue[_Item | None] = queue.Queue(_QUEUE_SIZE)
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="background worker", daemon=True)
        self._thread.start()

    def put(self, item: _Item) -> None:
        """Hand over an item; wait while the queue is full."""
        while True:
            self._raise_error()
            try:
                self._queue.put(item, timeout=_POLL_S)
                return
            except queue.Full:
                continue

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Wait until all items are done."""
        while self._thread.is_alive():
            try:
                self._queue.put(None, timeout=_POLL_S)
                break
            except queue.Full:
                continue
        self._thread.join()
        self._raise_error()

    def _raise_error(self) -> None:
        """Raise the error of the function, once."""
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
