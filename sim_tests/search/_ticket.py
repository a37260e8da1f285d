"""A trial that this process works on."""

from __future__ import annotations

from dataclasses import dataclass

from ._file_lock import FileLock
from ._search import Parameters


@dataclass(frozen=True, slots=True)
class Ticket:
    """A trial that this process works on, and nobody else while it lives.

    Attributes:
        number: of the trial.
        parameters: by name.
        lock: held until the trial is told.
    """

    number: int
    parameters: Parameters
    lock: FileLock
