"""The behaviour of people: they walk a route or a recorded track, look, decide and react."""

from __future__ import annotations

from ...conditions import POPULATIONS, PopulationName
from ._habits import (
    DEFAULT_POPULATION,
    FASTEST_RECORDED_MPS,
    draw_person,
    habits_of,
    known_population,
    median_person,
    population_of,
)
from ._hearing import Ears, Heard, Hearing, Request, RequestMeans, StartleKind
from ._person import DECISION_PERIOD_S, Person
from ._route import Route
from ._spec import GazeKey, Glances, Lapse, PersonSpec, Reactions, RoutePoint
from ._starting import LOOK_WITHIN_S, START_SHARES, start_share
from ._surroundings import ALONE, MovingBody, PersonMotion, PersonOutcome, RobotBody, Surroundings
from ._track import RecordedPath, Track, read_recordings
from ._trajectory import WALKER_RADIUS_M
