"""A server of models on loopback."""

from __future__ import annotations

import pytest
from model_server import ModelServer


@pytest.fixture
def server():
    with ModelServer() as running:
        yield running
