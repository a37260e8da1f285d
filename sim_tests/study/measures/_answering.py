"""The share of simulated people who answer a request, from the settings of a run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

# Hearing.answers of sim_tests.actors.behaviour, whose import needs the simulator.
DEFAULT_ANSWERS: Final = 0.5
_SETTING: Final = re.compile(r"(?:^|,)\s*answers\s*=\s*([^,\s]+)")


def answering_note(about: Any) -> str:
    """Return a sentence on the probability with which simulated people answer a request.

    Args:
        about: content of ``run.json``.

    Returns:
        The sentence; empty where the settings of the run are not known.
    """
    settings = about.get("settings") if isinstance(about, Mapping) else None
    if not isinstance(settings, Mapping):
        return ""
    population = str(settings.get("population") or "")
    found = _SETTING.search(population)
    if found is not None:
        share, source = found[1], f"population {population}"
    else:
        share, source = f"{DEFAULT_ANSWERS:g}", "the default, unless a scenario has its own"
    return f"Simulated people answer a request that they hear with probability {share} ({source})."
