"""Scenarios in which numbers may be distributions: one file, any number of episodes."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import ValidationError

from nav_adapter import RobotProfile
from perception.documents import yaml_text

from ..actors.behaviour import population_of
from ..actors.robot import RobotModel
from ..world.errors import SimError
from ._distributions import Distribution, error_text, find_parameters, with_numbers
from ._files import (
    camera_data,
    parse_yaml,
    read_file,
    require_version,
    shipped_scenarios,
    shipped_text,
)
from ._for_robot import scenario_for_robot
from ._networks import networks_data
from ._scenario import Scenario

# The key of a robot to which the scenario is fitted.
_FOR_ROBOT: Final = "for_robot"


class ScenarioTemplate:
    """A scenario in which some numbers are distributions.

    Any number under ``people`` and ``robot`` may be a mapping such as
    ``{uniform: {low: 1.0, high: 2.0}}``, ``{normal: {mean:, std:, low:, high:}}``,
    ``{lognormal: {median:, quartiles: [,]}}``, ``{integers: {low:, high:}}`` or
    ``{choice: [...]}``. A :class:`Scenario` is a template without distributions.

    The key ``for_robot`` names a robot (a shipped one, a YAML file, or the keys of a
    :class:`~sim_tests.actors.robot.RobotModel`) to which every scenario is fitted, see
    :func:`~sim_tests.scenario.scenario_for_robot`.

    Args:
        data: the keys of a scenario, as read from YAML.
        source: name of the scenario in messages.

    Raises:
        SimError: naming the wrong path, for unknown keys, impossible distributions, and a scenario
            that is not valid at the medians.
    """

    __slots__ = ("_data", "_median", "_parameters", "_robot", "_source")

    def __init__(self, data: Mapping[str, Any], source: str = "scenario") -> None:
        self._data: dict[str, Any] = copy.deepcopy(dict(data))
        self._source = source
        self._robot: RobotModel | None = None
        if _FOR_ROBOT in self._data:
            self._robot = _robot_of(self._data[_FOR_ROBOT], source)
        self._parameters = find_parameters(self._scenario_data, source)
        self._median = self.with_values({})

    @classmethod
    def from_yaml(cls, path: str | Path) -> ScenarioTemplate:
        """Read a file; its ``replay_csv`` is relative to its folder.

        Raises:
            SimError: naming the file, if it cannot be used.
        """
        return cls(read_file(Path(path), Scenario.model_fields), str(path))

    @classmethod
    def from_text(cls, text: str, source: str = "scenario") -> ScenarioTemplate:
        """Read YAML, for example the text of :meth:`to_text`."""
        return cls(parse_yaml(text, source), source)

    @classmethod
    def shipped(cls, name: str) -> ScenarioTemplate:
        """Load one that comes with the package, by ``name``, or by ``name@2`` with a version."""
        plain, text = shipped_text(name)
        template = cls.from_text(text, plain)
        require_version(name, template.version)
        return template

    @classmethod
    def named(cls, name: str) -> ScenarioTemplate:
        """Load a YAML file if the name ends in ``.yaml`` or ``.yml``, else a shipped one."""
        if name.endswith((".yaml", ".yml")):
            return cls.from_yaml(name)
        return cls.shipped(name)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self._median.name

    @property
    def version(self) -> int:
        """Number that grows with every change after which results cannot be compared."""
        return self._median.version

    @property
    def id(self) -> str:
        """Name and version, such as ``"crossing_from_left@1"``."""
        return f"{self.name}@{self.version}"

    @property
    def attention(self) -> Literal["attentive", "unaware", "mixed"]:
        """Label of the people's attention, see :class:`Scenario`."""
        return self._median.attention

    @property
    def description(self) -> str:
        """One sentence about the scenario."""
        return self._median.description

    def parameters(self) -> dict[str, Distribution]:
        """Return the distributions by dotted path, such as ``"people.0.speed_mps"``."""
        return dict(self._parameters)

    def median(self) -> Scenario:
        """Return the scenario with every distribution at its median."""
        return self._median

    def sample(self, rng: np.random.Generator) -> Scenario:
        """Draw a scenario.

        Each parameter has a random stream of its own, which depends only on the generator and on
        the parameter's path: adding or removing a parameter changes none of the others.

        Raises:
            SimError: if the values drawn are not valid together.
        """
        key = rng.integers(0, 2**32, 4, dtype=np.uint64).tolist()
        return self.with_values(
            {
                path: distribution.quantile(_uniform(key, path))
                for path, distribution in self._parameters.items()
            }
        )

    def for_seed(self, seed: int) -> Scenario:
        """Return the scenario of the episode with this seed."""
        return self.sample(np.random.default_rng(seed))

    def with_values(self, values: Mapping[str, float]) -> Scenario:
        """Return the scenario with these values of parameters and the medians of the others.

        Raises:
            SimError: for a path that is no parameter, and for values that are not valid.
        """
        data = with_numbers(self._scenario_data, self._parameters, values, self._source)
        scenario = Scenario.from_data(data, self._source)
        return scenario if self._robot is None else scenario_for_robot(scenario, self._robot)

    def with_robot(self, robot: RobotModel | RobotProfile | str | Path) -> ScenarioTemplate:
        """Return the same scenario fitted to another robot."""
        if robot == "":
            return self
        model = RobotModel.of(robot)
        return self._with(model.name, **{_FOR_ROBOT: model.model_dump(mode="json")})

    @property
    def _scenario_data(self) -> dict[str, Any]:
        return {key: value for key, value in self._data.items() if key != _FOR_ROBOT}

    def with_camera(self, name: str) -> ScenarioTemplate:
        """Return the same scenario with another camera on the robot."""
        return self._with(name, camera=camera_data(name)) if name else self

    def with_networks(self, named: str | Path) -> ScenarioTemplate:
        """Return the same scenario with other networks for the pictures of its camera."""
        return self._with(named, networks=networks_data(named)) if named else self

    def with_population(self, text: str) -> ScenarioTemplate:
        """Return the same scenario among people with other habits."""
        if not text:
            return self
        name, numbers = population_of(text)
        changes: dict[str, Any] = {} if name is None else {"population": name}
        if numbers:
            changes["hearing"] = {**self._data.get("hearing", {}), **numbers}
        return self._with(text, **changes)

    def _with(self, what: object, **changes: Any) -> ScenarioTemplate:
        return ScenarioTemplate({**self._data, **changes}, f"{self._source} with {what}")

    def to_text(self) -> str:
        """Return YAML for :meth:`from_text`, with the shared defaults written out."""
        return yaml_text(self._data)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ScenarioTemplate) and self._data == other._data

    def __hash__(self) -> int:
        return hash(self.to_text())

    def __repr__(self) -> str:
        return f"ScenarioTemplate({self.id!r}, {len(self._parameters)} parameters)"


def _robot_of(value: Any, source: str) -> RobotModel:
    try:
        return RobotModel.model_validate(value) if isinstance(value, dict) else RobotModel.of(value)
    except ValidationError as cause:
        raise SimError(f"{source}: {_FOR_ROBOT}: {error_text(cause)}") from cause


def shipped_templates(scenario_set: str = "all") -> tuple[ScenarioTemplate, ...]:
    """Return a set of the scenarios that come with the package, sorted by name."""
    return tuple(ScenarioTemplate.shipped(name) for name in shipped_scenarios(scenario_set))


def _uniform(key: list[int], path: str) -> float:
    """Return a number in [0, 1) that depends only on the key and the path."""
    digest = hashlib.sha256(path.encode()).digest()
    words = [int.from_bytes(digest[at : at + 4], "little") for at in range(0, 16, 4)]
    stream = np.random.default_rng(np.random.SeedSequence([*key, *words]))
    return float(stream.random())
