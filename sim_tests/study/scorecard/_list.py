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
    known = {name: _about(make) for name, make in makers.items()}
    if as_json:
        print(json_text([{"name": name, "about": about} for name, about in known.items()]), end="")
        return 0
    print(table_text(("planner", "about"), known.items(), left=2))
    print("\nA planner of yours: module:NAME, a class, a function that returns one, or an object.")
    return 0


def _about(make: object) -> str:
    """Return the first sentence about a planner, from its class or the function that makes it."""
    text = (inspect.getdoc(make) or "").partition("\n")[0].removeprefix("Return ")
    return text[:1].upper() + text[1:]
