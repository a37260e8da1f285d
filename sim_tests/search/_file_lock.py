"""A lock that the system takes back from whoever dies."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from awarenav.closing import Closing

from ..world.errors import SimError


class FileLock(Closing):
    """An exclusive lock on a file between processes of one machine (``flock``).

    It ends with :meth:`close` or with the process, however that ends.

    Args:
        path: made when missing.
        wait: wait for the lock; otherwise see :attr:`held`.

    Attributes:
        held: whether this object has the lock.

    Raises:
        SimError: for a place that cannot be written.
    """

    def __init__(self, path: Path, *, wait: bool = True) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as cause:
            raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
        self.held = True
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            os.close(self._file)
            self.held = False

    def close(self) -> None:
        """Give the lock back."""
        if self.held:
            self.held = False
            os.close(self._file)
