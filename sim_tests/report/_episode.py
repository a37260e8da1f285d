"""An episode as the report knows it: its row and its number."""

from __future__ import annotations

from dataclasses import dataclass

from ..measures._episode_record import EpisodeRecord


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode of a run.

    Attributes:
        number: counts jobs from 0; what ``awarenav replay`` asks for. None where no job is known.
        record: its row.
    """

    number: int | None
    record: EpisodeRecord

    @property
    def pair(self) -> tuple[str, int, int]:
        """Scenario, version and seed: what episodes of different policies have in common."""
        return self.record.scenario, self.record.scenario_version, self.record.seed
