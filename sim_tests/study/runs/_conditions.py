"""The conditions of a command's episodes: the one place that knows every axis of an experiment."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from nav_adapter import AwarenessPolicy

from ...crossing.eyes import PerceptionKind, SensorSet
from ._job import Job
from ._plan import plan_jobs


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """The conditions of the episodes that a command runs, by the names of its options.

    :func:`plan_jobs` describes them. A new axis is a field here, an argument there, and an option
    of the commands.

    Attributes:
        scenario: scenarios.
        planner: planners.
        perception: what the camera's pictures are evaluated by.
        sensors: sets of sensors.
        camera: replaces the camera of every scenario.
        robot: replaces the robot of every scenario.
        population: replaces the habits of the people.
        fault: faults.
        episodes: number of seeds.
        seed: the first seed.
    """

    scenario: Sequence[str]
    planner: Sequence[str] = ("",)
    perception: PerceptionKind = "keypoints"
    sensors: Sequence[SensorSet] = ("camera",)
    camera: str = ""
    robot: str = ""
    population: str | None = None
    fault: Sequence[str] = ("none",)
    episodes: int = 1
    seed: int = 0

    @classmethod
    def taken_from(cls, values: dict[str, Any]) -> Conditions:
        """Return the conditions among the options of a command, and take them out of these."""
        found: dict[str, Any] = {
            each.name: values.pop(each.name) for each in fields(cls) if each.name in values
        }
        for name in ("scenario", "planner", "sensors", "fault"):
            if isinstance(found.get(name), str):  # a command that takes one
                found[name] = (found[name],)
        return cls(**found)

    def jobs(self, policies: Sequence[str | tuple[str, AwarenessPolicy]]) -> tuple[Job, ...]:
        """Return the episodes of some policies; :func:`plan_jobs` names the errors."""
        return plan_jobs(
            self.scenario,
            policies,
            range(self.seed, self.seed + self.episodes),
            planners=self.planner,
            perception=self.perception,
            sensors=self.sensors,
            faults=self.fault,
            camera=self.camera,
            robot=self.robot,
            population=self.population or "",
        )

    def with_sensors(self, sensors: SensorSet) -> Conditions:
        """Return the same conditions with one set of sensors."""
        return replace(self, sensors=(sensors,))

    def about(self, command: str, out: Path, **more: Any) -> dict[str, Any]:
        """Return a command and its settings for ``run.json``; resuming a run gives the same.

        Args:
            command: name of the command.
            out: folder of the run.
            more: further settings, by the names of their options; None and empty ones are left out.
        """
        settings = {each.name: getattr(self, each.name) for each in fields(self)}
        settings["planner"] = [each or "reference" for each in self.planner]
        if tuple(self.sensors) == ("camera",):
            del settings["sensors"]
        settings = {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in {**settings, **more}.items()
            if value not in (None, "")
        }
        words = ["awarenav", command]
        for name, value in settings.items():
            words += [f"--{name}", *map(str, _several(value))]
        return {"command": shlex.join([*words, "--out", str(out)]), "settings": settings}


def _several(value: Any) -> Iterable[Any]:
    return value if isinstance(value, list) else [value]
