"""One test an episode, and one over all of them; see docs/test-suite.md."""

from __future__ import annotations

import pytest

from ._run import SuiteRun, planned


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make a test of every episode that the options ask for."""
    if "episode" in metafunc.fixturenames:
        plan = planned(metafunc.config)
        numbers = range(len(plan.jobs))
        metafunc.parametrize("episode", numbers, ids=[plan.name(number) for number in numbers])


@pytest.fixture(scope="session")
def crossings(request: pytest.FixtureRequest) -> SuiteRun:
    """The episodes, run on all cores when the first test asks for one."""
    plan = planned(request.config)
    chosen = [
        int(str(item.callspec.params["episode"]))
        for item in request.session.items
        if isinstance(item, pytest.Function) and item.function is test_episode
    ]
    return SuiteRun(plan, chosen or range(len(plan.jobs)))


def test_episode(crossings: SuiteRun, episode: int) -> None:
    """An episode holds what its scenario's thresholds ask for."""
    verdict = crossings.verdict(episode)
    if verdict:
        pytest.fail(verdict, pytrace=False)


def test_all_episodes(crossings: SuiteRun) -> None:
    """All episodes together hold what the thresholds ask for."""
    verdict = crossings.overall()
    if verdict:
        pytest.fail(verdict, pytrace=False)
