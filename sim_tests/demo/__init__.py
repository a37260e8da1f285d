"""The demonstration and the speed benchmark: ``awarenav demo`` and ``awarenav bench``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._cases import CASES, EncounterCase, case_values
    from ._demo import compare_policies, film_runs, run_demo
    from ._encounter import run_encounter
    from ._film import write_crossing_film
    from ._film_values import FilmRun, FilmValues, film_values
    from ._tables import ENCOUNTER_COLUMNS, EPISODE_COLUMNS, EpisodeTable, episode_row

__all__ = [
    "CASES",
    "ENCOUNTER_COLUMNS",
    "EPISODE_COLUMNS",
    "EncounterCase",
    "EpisodeTable",
    "FilmRun",
    "FilmValues",
    "case_values",
    "compare_policies",
    "episode_row",
    "film_runs",
    "film_values",
    "run_demo",
    "run_encounter",
    "write_crossing_film",
]

__getattr__ = lazy_page(__name__, __file__)
