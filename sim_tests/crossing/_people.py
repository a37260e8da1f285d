"""The people of a scenario on the stage: how they move, and how they hear."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from perception.arrays import FloatArray

from ..actors.behaviour import (
    Ears,
    Glances,
    Person,
    PersonSpec,
    RoutePoint,
    Track,
    habits_of,
    read_recordings,
)
from ..actors.body import worker_names
from ..scenario import Scenario


def staged_people(
    scenario: Scenario, boxes_odom_m: FloatArray, rng: np.random.Generator
) -> tuple[tuple[Person, ...], tuple[Ears, ...]]:
    """Return the people of a scenario, then those who are replayed, and everybody's ears."""
    jitter, habits = scenario.start_jitter_s, habits_of(scenario.population)
    everybody = []
    for spec, own in zip(scenario.people, rng.spawn(len(scenario.people)), strict=True):
        offset = float(own.uniform(-jitter, jitter))
        everybody.append(Person(spec, own, boxes_odom_m, habits=habits, offset_s=offset))
    if scenario.replay_csv is not None:
        everybody += recorded_people(
            scenario.replay_csv,
            boxes_odom_m,
            reacts=scenario.replay_reacts,
            leaves=scenario.replay_leaves,
        )
    Person.bring_together(everybody)
    # The ears draw from generators of their own, which come after those of the people: what
    # people do whom nobody asks depends on nothing here.
    ears = tuple(
        Ears(scenario.hearing if person.spec.hearing is None else person.spec.hearing, stream)
        for person, stream in zip(everybody, rng.spawn(len(everybody)), strict=True)
    )
    return tuple(everybody), ears


def recorded_people(
    path: str | Path, boxes_odom_m: FloatArray, *, reacts: bool = False, leaves: bool = False
) -> list[Person]:
    """Return the recorded people of a table in order of their first rows, with different looks."""
    looks = worker_names()
    people = []
    for number, recording in enumerate(read_recordings(path)):
        x_m, y_m = recording.positions_odom_m[0].tolist()
        spec = PersonSpec(
            name=recording.name,
            look=looks[number % len(looks)],
            route=(RoutePoint(x_m=x_m, y_m=y_m),),
            glances=Glances(notices_within_m=0.0),
        )
        track = Track(recording, reacts=reacts, leaves=leaves)
        people.append(Person(spec, np.random.default_rng(0), boxes_odom_m, track=track))
    return people
