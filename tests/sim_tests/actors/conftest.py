"""The hall that tests of a module share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    """Return an open floor."""
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        yield warehouse
