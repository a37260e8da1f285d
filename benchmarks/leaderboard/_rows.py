"""The rows of the leaderboard, as ``docs/leaderboard/rows.yaml`` lists them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from pydantic import Field, ValidationError, model_validator

from awarenav.errors import not_one_of
from nav_adapter import AwarenessPolicy
from perception.documents import read_yaml
from sim_tests import SimError
from sim_tests.conditions import Perception
from sim_tests.crossing import named_policy
from sim_tests.scenario import Scenario
from sim_tests.study.runs import Job, named_scenarios, plan_jobs, policy_text
from sim_tests.world.config import SimConfig

#: The repository.
ROOT: Final = Path(__file__).resolve().parents[2]
#: Folder of the rows and of their results.
RESULTS: Final = ROOT / "docs" / "leaderboard"
#: Folder of the rows of people who step out, and of their results.
STEP_OUT: Final = RESULTS / "step_out"
#: Folder of the runs that measure them, which git ignores.
WORK: Final = ROOT / "build" / "leaderboard"
#: The page.
PAGE: Final = ROOT / "docs" / "what_it_wins.md"
_ROWS_FILE: Final = "rows.yaml"
_TRUTH: Final = "truth"
_REFERENCE: Final = "reference"


class Row(SimConfig):
    """One row: a policy with sensors, a planner, and perhaps networks.

    Attributes:
        name: name of the file of its results.
        policy: a preset, ``"scanner"``, or a YAML file by its path in the repository.
        sensors: ``"truth"`` knows everybody in all directions; the others perceive.
        planner: ``"reference"``, ``"costmap"`` or ``"module:Class"``.
        networks: a file as for ``--networks`` of ``awarenav crossings``, by its path in the
            repository: they see rendered images; without one the camera sees keypoints.
    """

    name: str = Field(pattern=r"^[\w.+-]+$")
    policy: str
    sensors: Literal["truth", "camera", "camera+scanner", "scanner"]
    planner: str = _REFERENCE
    networks: str = ""

    @property
    def perception(self) -> str:
        """The perception of its episodes."""
        if self.sensors == _TRUTH:
            return _TRUTH
        return Perception.of(self._kind, self.sensors).name

    @property
    def senses(self) -> str:
        """The sensors, and the networks if there are any."""
        return f"{self.sensors} with {Path(self.networks).stem}" if self.networks else self.sensors

    @property
    def _kind(self) -> str:
        return "pixels" if self.networks else "keypoints"

    @property
    def policy_name(self) -> str:
        """The policy's name in tables."""
        return Path(self.policy).stem

    @property
    def _policy(self) -> AwarenessPolicy:
        path = ROOT / self.policy
        return named_policy(path if path.suffix else self.policy)[1]

    @property
    def digest(self) -> str:
        """A digest of policy, perception, planner's name and networks: what results belong to."""
        text = "\n".join((policy_text(self._policy), self.perception, self.planner))
        if self.networks:
            text += (ROOT / self.networks).read_text(encoding="utf-8")
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def jobs(self, scenarios: Sequence[Scenario], seeds: Sequence[int]) -> tuple[Job, ...]:
        """Return its episodes: every seed in every scenario.

        Raises:
            SimError: its planner cannot be made, or its networks cannot be loaded.
        """
        truth = self.sensors == _TRUTH
        return plan_jobs(
            scenarios,
            [(self.policy_name, self._policy)],
            seeds,
            planners=["" if self.planner == _REFERENCE else self.planner],
            perception=_TRUTH if truth else self._kind,
            sensors=["camera" if truth else self.sensors],
            networks=str(ROOT / self.networks) if self.networks else "",
        )


class Board(SimConfig):
    """All rows, and the episodes that each of them runs.

    Attributes:
        scenarios: shipped names, or ``all`` of those that have a planner.
        seeds: number of seeds from 0 on; every row runs each of them in every scenario.
        baseline: name of the row that others are compared with.
        rows: the rows.
    """

    scenarios: tuple[str, ...]
    seeds: int = Field(ge=1)
    baseline: str
    rows: tuple[Row, ...]

    @model_validator(mode="after")
    def _names_fit(self) -> Board:
        names = [row.name for row in self.rows]
        if len(set(names)) < len(names):
            raise ValueError(f"each row needs a name of its own, got {', '.join(names)}")
        if self.baseline not in names:
            raise ValueError(not_one_of("baseline", self.baseline, names))
        return self

    @classmethod
    def read(cls, folder: Path = RESULTS) -> Board:
        """Read ``rows.yaml`` of a folder.

        Raises:
            SimError: it cannot be read, or a row is not valid.
        """
        path = folder / _ROWS_FILE
        try:
            return cls.model_validate(read_yaml(path, SimError))
        except ValidationError as cause:
            raise SimError(f"{path.name}: {cause}") from cause

    @property
    def all_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios."""
        return named_scenarios(self.scenarios)

    def named(self, name: str) -> Row:
        """Return a row.

        Raises:
            SimError: there is none of that name.
        """
        found = next((row for row in self.rows if row.name == name), None)
        if found is None:
            raise SimError(not_one_of("--row", name, [row.name for row in self.rows]))
        return found
