"""The scenarios that a search goes through."""

from __future__ import annotations

from collections.abc import Sequence

from ..scenario import ScenarioTemplate, shipped_templates
from ..world.errors import SimError


def named_templates(names: Sequence[str], camera: str = "") -> tuple[ScenarioTemplate, ...]:
    """The scenarios of names and YAML files; ``all`` stands for the shipped ones with a planner.

    ``camera`` is as for :meth:`ScenarioTemplate.with_camera`.

    Raises:
        SimError: for an unknown name, an unusable file, a camera that is none, or two
            scenarios of one name.
    """
    found: dict[str, ScenarioTemplate] = {}
    for name in names:
        if name == "all":
            chosen = tuple(
                each
                for each in shipped_templates()
                if each.median().robot.straight_on_speed_mps is None
            )
        else:
            chosen = (ScenarioTemplate.named(name),)
        for template in (each.with_camera(camera) for each in chosen):
            if found.setdefault(template.name, template) != template:
                raise SimError(f"two scenarios are called {template.name!r}; give them other names")
    return tuple(found.values())
