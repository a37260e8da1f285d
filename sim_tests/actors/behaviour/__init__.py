"""What people do: scripts, recorded paths, and walkers that look, decide and react."""

from __future__ import annotations

from ._person import (
    MovingBody,
    PersonBehaviour,
    PersonMotion,
    PersonOutcome,
    RobotBody,
    Surroundings,
)
from ._replayed import replayed_people
from ._script import WorkerScript
from ._scripted import Scripted
from ._spec import PersonSpec
from ._walker import Walker

__all__ = [
    "MovingBody",
    "PersonBehaviour",
    "PersonMotion",
    "PersonOutcome",
    "PersonSpec",
    "RobotBody",
    "Scripted",
    "Surroundings",
    "Walker",
    "WorkerScript",
    "replayed_people",
]
