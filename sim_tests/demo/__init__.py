"""The demonstration and the speed benchmark: ``awarenav demo`` and ``awarenav bench``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._cases import CASES, EncounterCase, case_values
    from ._demo import compare_policies, run_demo
    from ._encounter import run_encounter
    from ._tables import ENCOUNTER_COLUMNS, EPISODE_COLUMNS, EpisodeTable, episode_row

__all__ = [
    "CASES",
    "ENCOUNTER_COLUMNS",
    "EPISODE_COLUMNS",
    "EncounterCase",
    "EpisodeTable",
    "case_values",
    "compare_policies",
    "episode_row",
    "run_demo",
    "run_encounter",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._cases": (
            "CASES",
            "EncounterCase",
            "case_values",
        ),
        "._demo": (
            "compare_policies",
            "run_demo",
        ),
        "._encounter": ("run_encounter",),
        "._tables": (
            "ENCOUNTER_COLUMNS",
            "EPISODE_COLUMNS",
            "EpisodeTable",
            "episode_row",
        ),
    },
)
