"""The scenarios among which a falsification searches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from ...scenario import Choice, Distribution, Integers, Scenario, ScenarioTemplate
from ...world.errors import SimError
from .._search import Range
from ._person_levers import changed_person, person_levers, way_of
from ._script_levers import changed_script, is_human, script_levers, script_way
from ._way import RACK_CLEARANCE_M, ROBOT_CLEARANCE_M, Lever, clearance_m

# What is not possible is drawn back towards the scenario as written, in these steps.
_SHARES: Final = (1.0, 0.75, 0.5, 0.25, 0.0)
# Searched by quantile, for what lies between their values does not exist.
_DISCRETE: Final = (Choice, Integers)
_PIECES: Final = {"workers": script_levers, "people": person_levers}


class PeopleSpace:
    """Variations of a scenario that humans could act out.

    What varies are the scenario's own distributions and the levers of its first people
    (:func:`person_levers`, :func:`script_levers`). What would lead through a rack, begin at the
    robot or ask for more than human speed or acceleration is drawn back towards the scenario as
    it was written, as far as needed: every point of the space is a scenario.

    Args:
        template: the scenario.
        people: how many of its people are varied, in the stage's order.

    Raises:
        SimError: for a scenario without people.
    """

    def __init__(self, template: ScenarioTemplate, people: int = 2) -> None:
        self.template = template
        median = template.median()
        self._median: dict[str, Any] = median.model_dump(mode="json")
        self._boxes = median.layout.obstacle_boxes_odom
        who = [(kind, row) for kind in _PIECES for row in range(len(self._median[kind]))][:people]
        if not who:
            raise SimError(f"scenario {template.name!r} has no people to vary")
        self._who = who
        self._own = template.parameters()
        self.levers: dict[str, Lever] = {}
        for kind, row in who:
            for name, lever in _PIECES[kind](self._median[kind][row]).items():
                self.levers[f"{kind}.{row}.{name}"] = lever
        for path, distribution in self._own.items():
            if path not in self.levers:
                self.levers[path] = _own_lever(distribution)

    @property
    def ranges(self) -> dict[str, Range]:
        """Where to search, by lever."""
        return {name: lever.range for name, lever in self.levers.items()}

    @property
    def neutral(self) -> dict[str, float]:
        """The levers of the scenario as it was written."""
        return {name: lever.neutral for name, lever in self.levers.items()}

    def scenario(self, values: Mapping[str, float]) -> Scenario:
        """The variation nearest to these levers that is possible; its name is the template's."""
        for share in _SHARES:
            data = self._varied(
                {
                    name: lever.neutral + share * (values[name] - lever.neutral)
                    for name, lever in self.levers.items()
                }
            )
            if share == 0.0 or self._is_possible(data):
                try:
                    return Scenario.model_validate(data)
                except ValidationError as cause:
                    if share == 0.0:
                        raise SimError(f"scenario {self.template.name!r}: {cause}") from cause
        raise AssertionError  # pragma: no cover - the last share always returns or raises

    def _varied(self, values: Mapping[str, float]) -> dict[str, Any]:
        own = {path: _own_value(self._own[path], values[path]) for path in self._own}
        data: dict[str, Any] = self.template.with_values(own).model_dump(mode="json")
        data["start_jitter_s"] = 0.0
        for kind, row in self._who:
            start = f"{kind}.{row}."
            mine = {n[len(start) :]: v for n, v in values.items() if n.startswith(start)}
            change = changed_script if kind == "workers" else changed_person
            data[kind][row] = change(data[kind][row], mine)
        return data

    def _is_possible(self, data: Mapping[str, Any]) -> bool:
        robot = np.array([data["robot"]["start_x_m"], data["robot"]["start_y_m"]])
        for kind, row in self._who:
            now, before = data[kind][row], self._median[kind][row]
            way = script_way if kind == "workers" else way_of
            here, there = way(now), way(before)
            for limit_m, found_m, was_m in (
                (
                    RACK_CLEARANCE_M,
                    clearance_m(here, self._boxes),
                    clearance_m(there, self._boxes),
                ),
                (
                    ROBOT_CLEARANCE_M,
                    float(np.linalg.norm(here[0] - robot)),
                    float(np.linalg.norm(there[0] - robot)),
                ),
            ):
                if found_m < min(limit_m, was_m) - 1e-9:
                    return False
            if kind == "workers" and not is_human(now, before):
                return False
        return True


def _own_lever(distribution: Distribution) -> Lever:
    low, high = distribution.bounds
    if isinstance(distribution, _DISCRETE):
        return Lever.of(0.0, 1.0, 0.5)
    return Lever.of(low, high, distribution.median)


def _own_value(distribution: Distribution, value: float) -> float:
    if isinstance(distribution, _DISCRETE):
        return distribution.quantile(value)
    low, high = distribution.bounds
    return min(max(value, low), high)
