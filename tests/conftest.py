"""Settings for every test."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from chromium_pipe import CHROMIUM, Chromium
from hypothesis import settings

# A busy machine must not fail a property for being slow; CI draws the same examples every time.
settings.register_profile("awarenav", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("awarenav")

# A shell ignores interrupts in what it runs in the background, and so do the commands that tests
# start there and interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--full`` runs what takes minutes."""
    parser.addoption("--full", action="store_true", help="run the tests marked full as well")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what takes minutes; shorter runs of the same are never left out."""
    if config.getoption("--full"):
        return
    skip = pytest.mark.skip(reason="takes minutes; pytest --full runs it")
    for item in items:
        if item.get_closest_marker("full"):
            item.add_marker(skip)


@pytest.fixture(scope="session", autouse=True)
def _no_fetched_networks(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Let no test depend on the networks that its user has fetched."""
    os.environ["AWARENAV_MODELS"] = str(tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    """Return a browser that all tests of a session share; without one they are skipped."""
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed")
    browser = Chromium(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()
