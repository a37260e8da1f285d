"""The histories of all tracks, as one frame after another tells them."""

from __future__ import annotations

from collections.abc import Iterable

from ._track_history import TrackHistory
from ._track_sample import TrackSample


class HistoryBook:
    """Grows the history of every track and notes who has gone."""

    def __init__(self) -> None:
        self._histories: dict[int, TrackHistory] = {}
        self._living: set[int] = set()

    def note(self, stamp_s: float, samples: Iterable[tuple[int, TrackSample]]) -> None:
        """Take the id and the sample of every track that there is at an instant.

        Stamps must not go back. Who is not among them any more has died, until they are back as
        people in files without a tracker may be.
        """
        present: set[int] = set()
        for id, sample in samples:
            present.add(id)
            history = self._histories.get(id)
            if history is None:
                self._histories[id] = TrackHistory(id, sample)
            else:
                history.died_s = None
                history.add(sample)
        for id in self._living - present:
            self._histories[id].died_s = stamp_s
        self._living = present

    def histories(self) -> tuple[TrackHistory, ...]:
        """All of them in the order of their ids."""
        return tuple(self._histories[id] for id in sorted(self._histories))
