"""A file lock that frees itself when the process that holds it dies."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final

import filelock

from ..world.errors import SimError

# How often a process that waits for a lock looks again.
_POLL_S: Final = 0.01


class ProcessLock(AbstractContextManager["ProcessLock"]):
    """An exclusive lock on a file, between processes of one computer.

    The lock ends with :meth:`close`, or with the process, even if it is killed. The file stays.

    Args:
        path: the file; it and its folder are made when missing.
        wait: wait until the lock is free; without it, :attr:`held` tells whether it was.

    Attributes:
        held: whether this object holds the lock.

    Raises:
        SimError: the file cannot be written.
    """

    def __init__(self, path: Path, *, wait: bool = True) -> None:
        # Any thread of this process may release the lock, not only the one that took it.
        self._lock = filelock.FileLock(path, thread_local=False)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._lock.acquire(blocking=wait, poll_interval=_POLL_S)
        except filelock.Timeout:
            pass
        except OSError as cause:
            raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
        self.held = self._lock.is_locked

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock."""
        self.held = False
        self._lock.release()
