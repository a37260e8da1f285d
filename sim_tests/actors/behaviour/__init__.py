"""The behaviour of people: scripts, recorded paths, and walkers that look, decide and react."""

from __future__ import annotations

from ._displaced import Displaced, displaced_people
from ._obstacles import WALKER_RADIUS_M
from ._person import (
    ALONE,
    MovingBody,
    PersonBehaviour,
    PersonMotion,
    PersonOutcome,
    RobotBody,
    Surroundings,
)
from ._replayed import RecordedPath, Replayed, read_recordings, replayed_people
from ._script import Scripted, WorkerScript
from ._spec import Glances, Lapse, PersonSpec, Reactions
from ._walker import DECISION_PERIOD_S, Walker

__all__ = [
    "ALONE",
    "DECISION_PERIOD_S",
    "WALKER_RADIUS_M",
    "Displaced",
    "Glances",
    "Lapse",
    "MovingBody",
    "PersonBehaviour",
    "PersonMotion",
    "PersonOutcome",
    "PersonSpec",
    "Reactions",
    "RecordedPath",
    "Replayed",
    "RobotBody",
    "Scripted",
    "Surroundings",
    "Walker",
    "WorkerScript",
    "displaced_people",
    "read_recordings",
    "replayed_people",
]
