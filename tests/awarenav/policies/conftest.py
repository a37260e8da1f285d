"""The policy explorer in a real browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from chromium_pipe import Chromium

from awarenav.cli import main


@pytest.fixture(scope="session")
def explorer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page as the command writes it."""
    page = tmp_path_factory.mktemp("explorer") / "explorer.html"
    assert main(["policy", "explore", "--out", str(page)]) == 0
    return page


@pytest.fixture
def page(chromium: Chromium, explorer: Path) -> Chromium:
    """Return the browser with the page freshly opened."""
    chromium.open(explorer)
    return chromium


@pytest.fixture
def functions(chromium: Chromium, explorer: Path) -> Chromium:
    """Return the browser with the page open, for tests of its functions alone."""
    if chromium.evaluate("typeof checkedPolicy") != "function":
        chromium.open(explorer)
    return chromium
