"""The hall that tests of a module share, and the workers in it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sim_tests.actors.body import Worker, load_worker, worker_names
from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    """Return an open floor."""
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        yield warehouse


@pytest.fixture(scope="module")
def workers(hall: Warehouse) -> dict[str, Worker]:
    """Return every shipped worker, as tall as it was made."""
    return {name: Worker(hall, load_worker(name).stature_m, look=name) for name in worker_names()}
