"""The people of a scenario on the stage: how they move, and how they hear."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

from ..actors.behaviour import (
    Answering,
    Ears,
    PersonBehaviour,
    PersonPath,
    Scripted,
    Walker,
    displaced_people,
    replayed_people,
    walker_of,
)
from ..scenario import Scenario


def staged_people(
    scenario: Scenario,
    boxes_odom_m: FloatArray,
    start_offsets_s: FloatArray,
    rng: np.random.Generator,
) -> tuple[tuple[Walker, ...], tuple[PersonBehaviour, ...], tuple[Ears, ...]]:
    """Return the people who react, everybody, and everybody's ears.

    Everybody is in this order: scripted workers, people who react, replayed people.

    Args:
        scenario: the scenario.
        boxes_odom_m: (N, 4) racks and walls.
        start_offsets_s: how much later each scripted worker starts.
        rng: random generator of the people.
    """
    walkers = _walkers(scenario, boxes_odom_m, rng)
    scripted = (
        Scripted(script, float(offset))
        for script, offset in zip(scenario.workers, start_offsets_s, strict=True)
    )
    behaviours: tuple[PersonBehaviour, ...] = (
        *(Answering(person, boxes_odom_m) for person in scripted),
        *walkers,
        *(Answering(person, boxes_odom_m) for person in _recorded(scenario, boxes_odom_m)),
    )
    # The ears draw from generators of their own, which come after those of the walkers: what
    # people do whom nobody asks depends on nothing here.
    own = [script.hearing for script in scenario.workers]
    own += [person.hearing for person in scenario.people]
    own += [None] * (len(behaviours) - len(own))
    ears = tuple(
        Ears(scenario.hearing if hearing is None else hearing, stream)
        for hearing, stream in zip(own, rng.spawn(len(behaviours)), strict=True)
    )
    return walkers, behaviours, ears


def _walkers(
    scenario: Scenario, boxes_odom_m: FloatArray, rng: np.random.Generator
) -> tuple[Walker, ...]:
    """Return the people who react, each with a random generator of their own."""
    jitter = scenario.start_jitter_s
    make = walker_of(scenario.population)
    walkers = []
    for spec, own in zip(scenario.people, rng.spawn(len(scenario.people)), strict=True):
        offset = float(own.uniform(-jitter, jitter))
        walkers.append(make(spec, own, boxes_odom_m, offset_s=offset))
    return tuple(walkers)


def _recorded(scenario: Scenario, boxes_odom_m: FloatArray) -> tuple[PersonPath, ...]:
    path, leaves = scenario.replay_csv, scenario.replay_leaves
    if path is None:
        return ()
    if scenario.replay_reacts:
        return displaced_people(path, boxes_odom_m, leaves=leaves)
    return replayed_people(path, leaves=leaves)
