"""The command ``awarenav planners list``."""

from __future__ import annotations

import inspect

from awarenav.files import json_text

from ...crossing.planner import SamplingPlanner
from ..measures import table_text
from ..runs import KNOWN_PLANNERS
from ._plan import REFERENCE


def list_command(*, as_json: bool) -> int:
    """Print the planners that have a name, and the first sentence about each."""
    makers = {REFERENCE: SamplingPlanner, **KNOWN_PLANNERS}
    known = {name: (inspect.getdoc(make) or "").partition("\n")[0] for name, make in makers.items()}
    if as_json:
        print(json_text([{"name": name, "about": about} for name, about in known.items()]), end="")
        return 0
    print(table_text(("planner", "about"), known.items(), left=2))
    print("\nA planner of yours: module:NAME, a class, a function that returns one, or an object.")
    return 0
