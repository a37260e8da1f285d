"""The hall that tests of a module share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from visual_actors import AWAY_M, ShapeActor

from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    """Return an open floor."""
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        yield warehouse


@pytest.fixture
def add_actor(hall: Warehouse) -> Iterator[Callable[[ShapeActor], int]]:
    """Return a function that adds an actor to the shared hall until the end of the test."""
    added: list[ShapeActor] = []

    def add(actor: ShapeActor) -> int:
        added.append(actor)
        return hall.visuals.add_actor(actor)

    yield add
    for actor in added:
        actor.position_m = np.array(AWAY_M)
