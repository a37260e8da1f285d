"""Threads beside the estimator: one reads frames ahead, one does work in the background."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, suppress
from typing import Final, Generic, TypeVar

from ._sources import ImageSource, SourceFrame

_QUEUE_SIZE: Final = 4
_POLL_S: Final = 0.1

_Item = TypeVar("_Item")


class FramePrefetcher(AbstractContextManager["FramePrefetcher"]):
    """Iterates over the frames of a source, a few of which a thread reads ahead.

    A live source never waits: its newest frame replaces one that was not taken yet. An error of the
    source is raised here, after the frames before it. On exit the thread has ended, and reads the
    source no more.

    Args:
        source: of the frames.
        every: takes every N-th frame only; one with a problem is never skipped.
        limit: most frames to take; None for all.
    """

    def __init__(self, source: ImageSource, every: int = 1, limit: int | None = None) -> None:
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
        while (item := self._queue.get()) is not None:
            if isinstance(item, BaseException):
                raise item
            yield item

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        while self._thread.is_alive():
            with suppress(queue.Empty):  # a thread that waits for a free place then sees the stop
                self._queue.get_nowait()
            self._thread.join(_POLL_S)

    def _read(self) -> None:
        """Read frames into the queue until the end, the limit or an error (in the thread)."""
        last: BaseException | None = None
        taken = 0
        try:
            for index, frame in enumerate(self._source.frames()):
                if self._stop.is_set():
                    break
                if index % self._every and frame.image_rgb is not None:
                    continue
                if self._source.live and frame.image_rgb is not None:
                    with suppress(queue.Empty):
                        self._queue.get_nowait()
                self._queue.put(frame)
                taken += 1
                if taken == self._limit:
                    break
        except BaseException as error:
            last = error
        self._queue.put(last)


class BackgroundWorker(AbstractContextManager["BackgroundWorker[_Item]"], Generic[_Item]):
    """Calls a function with one item after another, in a thread.

    An error of the function is raised by a later :meth:`put` or on exit; the items after it are
    dropped then.

    Args:
        work: the function.
    """

    def __init__(self, work: Callable[[_Item], None]) -> None:
        self._work = work
        self._executor = ThreadPoolExecutor(1, "background worker")
        self._pending: deque[Future[None]] = deque()

    def put(self, item: _Item) -> None:
        """Hand over an item; wait while several others are pending."""
        self._pending.append(self._executor.submit(self._work, item))
        if len(self._pending) > _QUEUE_SIZE:
            self._finish_one()

    def __exit__(self, *error: object) -> None:
        """Wait until all items are done."""
        while self._pending:
            self._finish_one()
        self._executor.shutdown()

    def _finish_one(self) -> None:
        """Wait for the oldest item; after its error, drop all others."""
        try:
            self._pending.popleft().result()
        except BaseException:
            self._pending.clear()
            self._executor.shutdown(cancel_futures=True)
            raise
