"""Work handed to a thread of its own, in order, so that the giver need not wait for it."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Final, Generic, TypeVar

from .._closing import Closing

ItemT = TypeVar("ItemT")
_DEPTH: Final = 4
_POLL_S: Final = 0.1


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
