"""The behaviour of people: scripts, recorded paths, and walkers that look, decide and react."""

from __future__ import annotations

from ._answering import Answering
from ._displaced import Displaced, displaced_people
from ._hearing import Ears, Heard, Hearing, Request, RequestMeans, StartleKind
from ._obstacles import WALKER_RADIUS_M
from ._person import (
    ALONE,
    MovingBody,
    PersonBehaviour,
    PersonMotion,
    PersonOutcome,
    PersonPath,
    RobotBody,
    Surroundings,
)
from ._population import (
    DEFAULT_POPULATION,
    FASTEST_RECORDED_MPS,
    POPULATIONS,
    PopulationName,
    RecordedWalker,
    draw_person,
    known_population,
    median_person,
    population_of,
    walker_of,
)
from ._replayed import RecordedPath, Replayed, read_recordings, replayed_people
from ._script import Scripted, WorkerScript
from ._spec import Glances, Lapse, PersonSpec, Reactions
from ._starting import LOOK_WITHIN_S, START_SHARES, start_share
from ._walker import DECISION_PERIOD_S, Walker

__all__ = [
    "ALONE",
    "DECISION_PERIOD_S",
    "DEFAULT_POPULATION",
    "FASTEST_RECORDED_MPS",
    "LOOK_WITHIN_S",
    "POPULATIONS",
    "START_SHARES",
    "WALKER_RADIUS_M",
    "Answering",
    "Displaced",
    "Ears",
    "Glances",
    "Heard",
    "Hearing",
    "Lapse",
    "MovingBody",
    "PersonBehaviour",
    "PersonMotion",
    "PersonOutcome",
    "PersonPath",
    "PersonSpec",
    "PopulationName",
    "Reactions",
    "RecordedPath",
    "RecordedWalker",
    "Replayed",
    "Request",
    "RequestMeans",
    "RobotBody",
    "Scripted",
    "StartleKind",
    "Surroundings",
    "Walker",
    "WorkerScript",
    "displaced_people",
    "draw_person",
    "known_population",
    "median_person",
    "population_of",
    "read_recordings",
    "replayed_people",
    "start_share",
    "walker_of",
]
