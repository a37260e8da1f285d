"""A recorded crossing and its page, each made once."""

from __future__ import annotations

from pathlib import Path

import pytest
from viewed_crossing import record

from sim_tests.viewing import CrossingRecorder, outcome_text, write_page


@pytest.fixture(scope="session")
def recorded():
    """Recorder, result and frames of a crossing with pictures."""
    return record()


@pytest.fixture(scope="session")
def recorder(recorded) -> CrossingRecorder:
    return recorded[0]


@pytest.fixture(scope="session")
def page_file(recorded, tmp_path_factory: pytest.TempPathFactory) -> Path:
    recorder, result, _ = recorded
    path = tmp_path_factory.mktemp("page") / "short.html"
    write_page(path, recorder.begin, recorder.states, outcome_text(result), recorder.note)
    return path
