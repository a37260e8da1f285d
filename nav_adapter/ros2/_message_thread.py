"""A thread that passes waiting messages to a bridge, for cameras and for scanners."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

from .._errors import NavError
from ._bridge import AwarenessBridge


class MessageThread(ABC):
    """A thread that waits for messages and passes one after the other to a bridge.

    An error of the program does not end it; the bridge reports and counts it
    (:meth:`AwarenessBridge.perception_failed`). A subclass starts it when it is complete.

    Args:
        bridge: its :meth:`~AwarenessBridge.tick` is called by another thread.
        name: of the thread.
    """

    def __init__(self, bridge: AwarenessBridge, name: str) -> None:
        self._bridge = bridge
        self._closing = False
        self._changed = threading.Condition()
        # A network that hangs must not keep the process from ending.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def close(self, timeout_s: float = 5.0) -> bool:
        """End the thread after the message in hand; return False if that takes too long."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @abstractmethod
    def _is_waiting(self) -> bool:
        """Return whether a message waits; called with the lock."""

    @abstractmethod
    def _take(self) -> Callable[[], None]:
        """Remove the next message and return what passes it on; called with the lock."""

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._is_waiting())
                if self._closing:
                    return
                pass_on = self._take()
            try:
                pass_on()
            except NavError as problem:
                self._bridge.refuse(str(problem))
            except Exception as problem:
                self._bridge.perception_failed(problem)
