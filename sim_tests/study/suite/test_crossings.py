"""One test per episode, and one over all episodes; see docs/test-suite.md."""

from __future__ import annotations

import pytest

from ._run import SuiteRun, planned
from .plugin import NOTES


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make one test for each episode of the options."""
    if "episode" in metafunc.fixturenames:
        plan = planned(metafunc.config)
        numbers = range(len(plan.jobs))
        metafunc.parametrize("episode", numbers, ids=[plan.name(number) for number in numbers])


@pytest.fixture(scope="session")
def crossings(request: pytest.FixtureRequest) -> SuiteRun:
    """Run the episodes of the selected tests, on all cores."""
    plan = planned(request.config)
    selected = [
        int(str(item.callspec.params["episode"]))
        for item in request.session.items
        if isinstance(item, pytest.Function) and item.function is test_episode
    ]
    run = SuiteRun(plan, selected or range(len(plan.jobs)))
    request.config.stash[NOTES] = run.notes
    return run


def test_episode(crossings: SuiteRun, episode: int) -> None:
    """An episode meets the thresholds of its scenario."""
    verdict = crossings.verdict(episode)
    if verdict:
        pytest.fail(verdict, pytrace=False)


def test_all_episodes(crossings: SuiteRun) -> None:
    """All episodes together meet the thresholds."""
    verdict = crossings.overall()
    if verdict:
        pytest.fail(verdict, pytrace=False)
