"""The search space of a falsification: variations of one scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from perception.arrays import FloatArray
from tracking.config import complaints

from ...actors.behaviour import FASTEST_RECORDED_MPS, PersonSpec, median_person
from ...actors.robot import NOVA_CARTER
from ...scenario import Choice, Distribution, Integers, Scenario
from ...world.errors import SimError
from .._study import Range
from ._parameters import (
    FASTEST_WALK_MPS,
    RACK_CLEARANCE_M,
    ROBOT_CLEARANCE_M,
    Parameter,
    add_joint,
    changed_hearing,
    changed_person,
    clearance_m,
    hearing_parameters,
    is_joint_possible,
    joint_parameters,
    person_parameters,
    person_path,
)

# An impossible variation is drawn back to a share of its distance from the scenario as written.
_SHARES: Final = (1.0, 0.75, 0.5, 0.25, 0.0)
# Searched by quantile, because nothing exists between their values.
_DISCRETE: Final = (Choice, Integers)


class ScenarioSpace:
    """The variations of a scenario that humans could act out.

    A variation changes the scenario's own distributions and the parameters of its first people
    (:func:`person_parameters`), and may add a companion or a parked pallet, or exchange two
    people's ways (:func:`joint_parameters`). A variation that leads through a rack or begins at the
    robot is drawn back towards the scenario as written, as far as needed. Every point of the space
    is therefore a scenario.

    The varied people of the recorded population do not draw their speed and glances. These begin at
    the population's medians instead (:func:`~sim_tests.actors.behaviour.median_person`), and are
    parameters as in the classic one.

    Args:
        scenario: the scenario as written.
        people: number of people that are varied, in the stage's order.
        asks: the robot asks for attention, so how the varied people answer is varied as well
            (:func:`hearing_parameters`).
    """

    def __init__(self, scenario: Scenario, people: int = 2, *, asks: bool = False) -> None:
        self.written = scenario
        self._median: dict[str, Any] = scenario.model_dump(mode="json")
        self._boxes = scenario.layout.obstacle_boxes_odom
        reach_m = scenario.robot_profile.circumscribed_radius_m
        self._longer_m = max(reach_m - NOVA_CARTER.circumscribed_radius_m, 0.0)
        self._asks = asks
        self._is_recorded = scenario.population == "recorded"
        self._varied = range(min(people, len(self._median["people"])))
        if not self._varied:
            raise SimError(f"scenario {scenario.name!r} has no people to vary")
        self._take_medians(self._median)
        self._distributions = scenario.distributions
        self.parameters: dict[str, Parameter] = {}
        for row in self._varied:
            for name, parameter in self._own_parameters(row).items():
                self.parameters[f"people.{row}.{name}"] = parameter
        self._joint = joint_parameters([self._median["people"][row] for row in self._varied])
        self.parameters |= self._joint
        for path, distribution in self._distributions.items():
            if path not in self.parameters:
                self.parameters[path] = _distribution_parameter(distribution)

    @property
    def ranges(self) -> dict[str, Range]:
        """Ranges of the parameters."""
        return {name: each.range for name, each in self.parameters.items()}

    @property
    def neutral(self) -> dict[str, float]:
        """Values of the parameters in the scenario as written."""
        return {name: each.neutral for name, each in self.parameters.items()}

    def scenario(self, values: Mapping[str, float]) -> Scenario:
        """Return the possible variation nearest to these values; it keeps the name."""
        for share in _SHARES:
            shared = {
                name: each.neutral + share * (values[name] - each.neutral)
                for name, each in self.parameters.items()
            }
            data = self._variation(shared)
            if share == 0.0 or self._is_possible(data, shared):
                try:
                    return Scenario.model_validate(data)
                except ValidationError as cause:
                    if share == 0.0:
                        raise SimError(
                            f"scenario {self.written.name!r}: {complaints(cause)}"
                        ) from cause
        raise AssertionError  # pragma: no cover - the last share always returns or raises

    def _variation(self, values: Mapping[str, float]) -> dict[str, Any]:
        drawn = {
            path: _distribution_value(each, values[path])
            for path, each in self._distributions.items()
        }
        data: dict[str, Any] = self.written.with_values(drawn).model_dump(mode="json")
        data["start_jitter_s"] = 0.0
        self._take_medians(data)
        for row in self._varied:
            prefix = f"people.{row}."
            own_values = {
                name.removeprefix(prefix): value
                for name, value in values.items()
                if name.startswith(prefix)
            }
            own = data["people"][row] = changed_person(data["people"][row], own_values)
            if self._asks:
                own["hearing"] = changed_hearing(own["hearing"], data["hearing"], own_values)
        add_joint(data, {name: values[name] for name in self._joint})
        return data

    def _own_parameters(self, row: int) -> dict[str, Parameter]:
        person = self._median["people"][row]
        answer: dict[str, Parameter] = {}
        if self._asks:
            answer = hearing_parameters(person["hearing"] or self._median["hearing"])
        fastest = FASTEST_RECORDED_MPS if self._is_recorded else FASTEST_WALK_MPS
        return person_parameters(person, fastest) | answer

    def _take_medians(self, data: dict[str, Any]) -> None:
        """Give the varied people of the recorded population its medians."""
        if not self._is_recorded:
            return
        for row in self._varied:
            person = PersonSpec.model_validate(data["people"][row])
            data["people"][row] = median_person(person).model_dump(mode="json")

    def _is_possible(self, data: Mapping[str, Any], values: Mapping[str, float]) -> bool:
        if not is_joint_possible(data, values, self._boxes, self._longer_m):
            return False
        robot = np.array([data["robot"]["start_x_m"], data["robot"]["start_y_m"]])
        added = data["people"][len(self._median["people"]) :]
        if not all(self._keeps_clear(person_path(person), robot) for person in added):
            return False
        return all(
            self._keeps_clear(
                person_path(data["people"][row]), robot, person_path(self._median["people"][row])
            )
            for row in self._varied
        )

    def _keeps_clear(
        self, path: FloatArray, robot: FloatArray, written: FloatArray | None = None
    ) -> bool:
        """Return whether a path keeps clear of racks, and its start of the robot's.

        It need not keep farther away than the path as written.
        """
        found, was = (
            (clearance_m(each, self._boxes), float(np.linalg.norm(each[0] - robot)))
            for each in (path, path if written is None else written)
        )
        limits = RACK_CLEARANCE_M, ROBOT_CLEARANCE_M + self._longer_m
        if written is not None:
            limits = min(limits[0], was[0]), min(limits[1], was[1])
        return all(each >= limit - 1e-9 for each, limit in zip(found, limits, strict=True))


def _distribution_parameter(distribution: Distribution) -> Parameter:
    low, high = distribution.bounds
    if isinstance(distribution, _DISCRETE):
        return Parameter.of(0.0, 1.0, 0.5)
    return Parameter.of(low, high, distribution.median)


def _distribution_value(distribution: Distribution, value: float) -> float:
    if isinstance(distribution, _DISCRETE):
        return distribution.quantile(value)
    low, high = distribution.bounds
    return min(max(value, low), high)
